#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <future>
#include <optional>
#include <set>
#include <thread>

#include "jobs/all_jobs.h"
#include "scheduler/api/http_server.h"
#include "scheduler/api/queries.h"
#include "scheduler/cli/commands.h"
#include "scheduler/cli/parse.h"
#include "scheduler/cli/programs.h"
#include "scheduler/cli/progress_display.h"
#include "scheduler/cli/report_keeper.h"
#include "scheduler/cli/run_summary.h"
#include "scheduler/cli/shot_facts.h"
#include "scheduler/cli/stop_signal.h"
#include "scheduler/cli/worker_pool.h"
#include "scheduler/farm/farm.h"
#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr int kBeatMs = 150;
constexpr int kWorkersPatienceMs = 5000;

struct RunOptions {
  fs::path shot;
  int num_workers = 0;
  std::string until, http = "127.0.0.1:0";
  bool no_http = false, json = false;
};

RunOptions parse_options(const Arguments& arguments) {
  CLI::App app{"Runs a shot on this machine: a scheduler, workers and a page. Finished work is never done again.",
               "vantage run"};
  RunOptions options;
  app.add_option("shot", options.shot, "folder of the shot")->required();
  app.add_option("--workers", options.num_workers, "jobs at the same time; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--until", options.until, "stop after this stage, e.g. calibrate");
  app.add_option("--http", options.http, "address of the page; port 0: any free one")->capture_default_str();
  app.add_flag("--no-http", options.no_http, "no page");
  app.add_flag("--json", options.json, "only a summary at the end, for programs");
  parse(app, arguments);
  if (options.num_workers == 0)
    options.num_workers = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  if (!options.until.empty() && find_kind(options.until) == nullptr)
    throw Error(ErrorKind::BadInput,
                fmt::format("--until {}: no such stage{}", options.until, did_you_mean(options.until, kind_names())));
  return options;
}

/// Nine tenths of the machine's memory, shared out evenly.
int ram_mb_per_worker(int num_workers) {
  const auto total_mb = static_cast<std::int64_t>(sysconf(_SC_PHYS_PAGES)) * sysconf(_SC_PAGE_SIZE) / 1'000'000;
  return static_cast<int>(total_mb * 9 / 10 / num_workers);
}

std::unique_ptr<ProgressDisplay> make_display(const RunOptions& options) {
  if (options.json) return make_silent_display();
  return isatty(STDOUT_FILENO) ? make_terminal_display() : make_plain_display();
}

/// Everything of one run, in the order in which it must go away.
class ShotRun {
 public:
  explicit ShotRun(const RunOptions& options)
      : options_(options),
        display_(make_display(options)),
        state_dir_(options.shot / ".vantage" / "farm"),
        farm_({.state_dir = state_dir_, .bus_url = "", .listen = "127.0.0.1", .http_address = "", .lease_ms = 15000}),
        reports_(state_dir_, system_clock()) {}

  /// Empty when it was stopped before the end.
  std::optional<ShotProgress> run() {
    start_page();
    const SubmitResult submitted =
        farm_.submit({.folder = options_.shot, .until_kind = options_.until, .priority = 0}).get();
    WorkerPool workers({.program = sibling_program("vantage-worker"),
                        .bus_url = farm_.bus_url(),
                        .key_file = farm_.key_file(),
                        .folder = state_dir_,
                        .num_workers = options_.num_workers,
                        .ram_mb = ram_mb_per_worker(options_.num_workers)},
                       system_clock());
    const auto last = watch(submitted.shot, workers);
    workers.stop(kWorkersPatienceMs);
    if (last) say_all(reports_.keep({*last}));
    return last;
  }
  const fs::path& state_dir() const { return state_dir_; }
  std::string page() const { return server_ ? server_->url() : ""; }

 private:
  void start_page() {
    if (options_.no_http) return;
    server_.emplace(
        HttpServer::Options{.listen = options_.http, .state_dir = state_dir_, .control = control_of(farm_)});
    farm_.set_http_address(server_->url());
    if (!options_.json) fmt::print("Page: {}\n", server_->page_url());
    std::fflush(stdout);
  }

  std::optional<ShotProgress> watch(ShotId shot, WorkerPool& workers) {
    for (;;) {
      const auto ended = farm_.wait(shot, kBeatMs);
      if (const auto progress = ended ? ended : farm_.progress(shot)) show(*progress);
      if (ended) return ended;
      if (stop_was_asked()) return std::nullopt;
      say_all(workers.mend());
      say_all(reports_.keep(farm_.all_progress()));
    }
  }

  void show(const ShotProgress& progress) {
    for (const auto& failure : progress.failures)
      if (said_failed_.insert(failure.name).second)
        display_->say(fmt::format("{} {}: {}", failure.name, failure.state, failure.error));
    display_->show(progress, system_clock().monotonic_ms());
  }
  void say_all(const std::vector<std::string>& sentences) {
    for (const auto& sentence : sentences) display_->say(sentence);
  }

  RunOptions options_;
  std::unique_ptr<ProgressDisplay> display_;
  fs::path state_dir_;
  FarmScheduler farm_;
  std::optional<HttpServer> server_;
  ReportKeeper reports_;
  std::set<std::string> said_failed_;
};

/// Footage that nobody has ingested yet is looked at first, so that a bad file is said at once and not by a failed job.
void look_at_new_footage(const Shot& shot, bool quiet) {
  if (fs::exists(shot.folder / ".vantage" / "store" / "ingest")) return;
  const auto footage = probe_shot(shot);
  if (!quiet)
    for (const auto& f : footage)
      for (const auto& warning : f.warnings) fmt::print("{}: {}\n", f.camera, warning);
  require_usable(footage);
}

}  // namespace

int run_shot_command(const Arguments& arguments) {
  RunOptions options = parse_options(arguments);
  const Shot shot = read_checked_shot(options.shot);
  options.shot = shot.folder;
  check_store(shot.folder);
  look_at_new_footage(shot, options.json);
  note_stop_signals();
  const std::int64_t start_wall_ms = system_clock().wall_ms(), start_ms = system_clock().monotonic_ms();
  ShotRun run(options);
  const auto last = run.run();
  if (!last) {
    fmt::print(options.json ? stderr : stdout, "\nStopped. Nothing finished is lost; go on with: vantage run {}\n",
               options.shot.string());
    return kExitFailed;
  }
  const RunSummary summary = summarize(*last, run.state_dir(), start_wall_ms,
                                       static_cast<double>(system_clock().monotonic_ms() - start_ms) / 1000);
  fmt::print("{}", options.json ? to_json(summary).dump() + "\n" : to_text(summary));
  return exit_code(summary);
}

}  // namespace vantage
