#include "worker/worker_main.h"

#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>

#include "schema/base/error.h"
#include "schema/base/json.h"
#include "worker/exec_command.h"
#include "worker/worker_loop.h"

namespace vantage {
namespace {

struct Cli {
  CLI::App app{"Runs the jobs of a Vantage farm: `vantage-worker --bus URL --farm-key FILE --state DIR`."};
  WorkerOptions worker;
  ExecOptions exec;
  ExportOptions depth;
  std::vector<std::string> footage;
  bool json = false;
  CLI::App* exec_command = nullptr;
  CLI::App* probe_command = nullptr;
  CLI::App* points_command = nullptr;
  CLI::App* mesh_command = nullptr;
  CLI::App* kinds_command = nullptr;
  CLI::App* fork_server_command = nullptr;
};

void declare_worker(CLI::App& app, WorkerOptions& w) {
  app.add_option("--bus", w.bus_url, "where the scheduler is: tcpq://host:port or udpm://239.255.76.67:7667?ttl=1");
  app.add_option("--farm-key", w.farm_key_file, "file with the farm's key");
  app.add_option("--state,--id-file", w.state_dir, "folder for this worker's identity and its unreported results");
  app.add_option("--slots", w.slots, "jobs at the same time")->check(CLI::Range(1, 1024))->capture_default_str();
  app.add_option("--pool", w.pool, "name of the group of machines that it belongs to");
  app.add_option("--tags", w.tags, "what sets this machine apart, with commas between: jobs may ask for it")
      ->delimiter(',');
  app.add_option("--cores", w.cores, "cores that jobs may use; 0: all")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  app.add_option("--ram-mb", w.ram_mb, "memory that jobs may use; 0: all but a tenth")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--stuck-after-s", w.stuck_after_s, "stop a job without progress and processor time for that long")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--parent", w.parent_pid, "stop, and stop all jobs, when this process, which started it, ends")
      ->check(CLI::PositiveNumber);
}

void declare_exec(Cli& cli) {
  cli.exec_command =
      cli.app.add_subcommand("exec", "run one job here, with no farm, and print the folder of its artifact");
  cli.exec_command->add_option("spec", cli.exec.spec, "the job's file, SHOT/.vantage/specs/…json")->required();
  cli.exec_command->add_option("--cores", cli.exec.cores, "threads to use; 0: as the file says")
      ->check(CLI::Range(0, 4096));
  cli.exec_command->add_option("--scratch", cli.exec.scratch_dir, "folder for temporary files");
  cli.exec_command->add_option("--spec-hash", cli.exec.spec_hash, "refuse a job file with another hash");
}

void declare_export(Cli& cli) {
  cli.points_command = cli.app.add_subcommand(
      "points", "write what the cameras' depth maps agree on at a moment as a coloured point cloud with normals");
  cli.points_command->add_option("--time-s", cli.depth.time_s, "moment on the shot's clock")->capture_default_str();
  cli.mesh_command = cli.app.add_subcommand(
      "mesh", "write an image's depth map as triangles, torn where depth steps: .ply, or .obj with its picture");
  cli.mesh_command->add_option("--image", cli.depth.image, "such as cam0-000003")->required();
  for (CLI::App* command : {cli.points_command, cli.mesh_command}) {
    command->add_option("shot", cli.depth.shot, "folder of a shot that was run with [depth]")->required();
    command->add_option("--to", cli.depth.to, "file to write")->required();
    command->add_option("--min-confidence", cli.depth.min_confidence, "depths below are left out")
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str();
  }
}

void declare(Cli& cli, const WorkerProgram& program) {
  cli.app.require_subcommand(0, 1);
  cli.app.set_version_flag("--version", "vantage-worker " VANTAGE_VERSION);
  declare_worker(cli.app, cli.worker);
  declare_exec(cli);
  if (program.probe) {
    cli.probe_command = cli.app.add_subcommand("probe", "say what footage is");
    cli.probe_command->add_option("footage", cli.footage, "videos, or patterns of stills")->required();
    cli.probe_command->add_flag("--json", cli.json, "for programs");
  }
  if (program.export_depth) declare_export(cli);
  cli.kinds_command = cli.app.add_subcommand("kinds", "list the kinds of jobs");
  cli.kinds_command->add_flag("--json", cli.json, "for programs");
  cli.fork_server_command = cli.app.add_subcommand("fork-server", "started by a worker for itself")->group("");
}

int print_kinds(const RunTable& runs, bool json) {
  Json all = Json::array();
  for (const auto& [spec, run] : runs) {
    if (json)
      all.push_back(
          {{"name", spec.name}, {"version", spec.version}, {"reads", spec.reads}, {"publishes", spec.publishes}});
    else
      fmt::print("{:<12} v{:<3} {} -> {}\n", spec.name, spec.version, spec.reads, spec.publishes);
  }
  if (json) fmt::print("{}\n", all.dump(1));
  return 0;
}

int run(const Cli& cli, const WorkerProgram& program) {
  if (cli.exec_command->parsed()) return run_exec_command(cli.exec, program);
  if (cli.probe_command != nullptr && cli.probe_command->parsed()) return program.probe(cli.footage, cli.json);
  if (program.export_depth && (cli.points_command->parsed() || cli.mesh_command->parsed()))
    return program.export_depth(cli.depth);
  if (cli.kinds_command->parsed()) return print_kinds(program.runs, cli.json);
  if (cli.fork_server_command->parsed())
    return run_fork_server(kForkServerSocket, [&program](const ChildRequest& request, ChildLink& link) {
      return run_child(request, link, program);
    });
  return run_worker(cli.worker, program);
}

}  // namespace

int worker_main(int argc, char** argv, const WorkerProgram& program) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("worker"));
  Cli cli;
  declare(cli, program);
  try {
    cli.app.parse(argc, argv);
    return run(cli, program);
  } catch (const CLI::ParseError& e) {
    return cli.app.exit(e) == 0 ? 0 : 2;
  } catch (const Error& e) {
    fmt::print(stderr, "error: {}\n", e.what());
    return e.kind() == ErrorKind::BadInput ? 2 : 1;
  } catch (const std::exception& e) {
    fmt::print(stderr, "error: {}\n", e.what());
    return 1;
  }
}

}  // namespace vantage
