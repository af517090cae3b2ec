#include <fmt/format.h>
#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <opencv2/core.hpp>

#include "schema/base/error.h"
#include "schema/base/json.h"
#include "worker/exec_command.h"
#include "worker/probe_command.h"
#include "worker/run_table.h"
#include "worker/worker_loop.h"

namespace vantage {
namespace {

struct Cli {
  CLI::App app{"Runs the jobs of a Vantage farm: `vantage-worker --bus URL --farm-key FILE --state DIR`."};
  WorkerOptions worker;
  ExecOptions exec;
  std::vector<std::string> footage;
  bool json = false;
  CLI::App* exec_command = nullptr;
  CLI::App* probe_command = nullptr;
  CLI::App* kinds_command = nullptr;
};

void declare_worker(CLI::App& app, WorkerOptions& w) {
  app.add_option("--bus", w.bus_url, "where the scheduler is: tcpq://host:port or udpm://239.255.76.67:7667?ttl=1");
  app.add_option("--farm-key", w.farm_key_file, "file with the farm's key");
  app.add_option("--state,--id-file", w.state_dir, "folder for this worker's identity and its unreported results");
  app.add_option("--slots", w.slots, "jobs at the same time")->check(CLI::Range(1, 1024))->capture_default_str();
  app.add_option("--pool", w.pool, "name of the group of machines that it belongs to");
  app.add_option("--cores", w.cores, "cores that jobs may use; 0: all")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  app.add_option("--ram-mb", w.ram_mb, "memory that jobs may use; 0: all but a tenth")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_flag("--die-with-parent", w.die_with_parent,
               "stop, and stop all jobs, when the process that started it ends");
}

void declare(Cli& cli) {
  cli.app.require_subcommand(0, 1);
  declare_worker(cli.app, cli.worker);
  cli.exec_command =
      cli.app.add_subcommand("exec", "run one job here, with no farm, and print the folder of its artifact");
  cli.exec_command->add_option("spec", cli.exec.spec, "the job's file, SHOT/.vantage/specs/…json")->required();
  cli.exec_command->add_option("--cores", cli.exec.cores, "threads to use; 0: as the file says")
      ->check(CLI::Range(0, 4096));
  cli.exec_command->add_option("--scratch", cli.exec.scratch_dir, "folder for temporary files");
  cli.exec_command->add_option("--spec-hash", cli.exec.spec_hash, "refuse a job file with another hash");
  cli.exec_command->add_option("--outcome", cli.exec.outcome_file, "write how it ended to this file");
  cli.exec_command->add_option("--progress", cli.exec.progress_file, "write progress to this file");
  cli.probe_command = cli.app.add_subcommand("probe", "say what footage is");
  cli.probe_command->add_option("footage", cli.footage, "videos, or patterns of stills")->required();
  cli.probe_command->add_flag("--json", cli.json, "for programs");
  cli.kinds_command = cli.app.add_subcommand("kinds", "list the kinds of jobs");
  cli.kinds_command->add_flag("--json", cli.json, "for programs");
}

int print_kinds(bool json) {
  Json all = Json::array();
  for (const auto& [spec, run] : run_table()) {
    if (json)
      all.push_back(
          {{"name", spec.name}, {"version", spec.version}, {"reads", spec.reads}, {"publishes", spec.publishes}});
    else
      fmt::print("{:<12} v{:<3} {} -> {}\n", spec.name, spec.version, spec.reads, spec.publishes);
  }
  if (json) fmt::print("{}\n", all.dump(1));
  return 0;
}

int run(const Cli& cli) {
  if (cli.exec_command->parsed())
    return run_exec_command(cli.exec, {.find_run = find_run, .limit_threads = cv::setNumThreads});
  if (cli.probe_command->parsed()) return run_probe_command(cli.footage, cli.json);
  if (cli.kinds_command->parsed()) return print_kinds(cli.json);
  return run_worker(cli.worker);
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("worker"));
  vantage::Cli cli;
  vantage::declare(cli);
  try {
    cli.app.parse(argc, argv);
    return vantage::run(cli);
  } catch (const CLI::ParseError& e) {
    return cli.app.exit(e) == 0 ? 0 : 2;
  } catch (const vantage::Error& e) {
    fmt::print(stderr, "error: {}\n", e.what());
    return e.kind() == vantage::ErrorKind::BadInput ? 2 : 1;
  } catch (const std::exception& e) {
    fmt::print(stderr, "error: {}\n", e.what());
    return 1;
  }
}
