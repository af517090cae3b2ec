#include <fmt/format.h>
#include <signal.h>
#include <stdlib.h>

#include <chrono>
#include <optional>
#include <thread>

#include "scheduler/cli/bench_scheduler.h"
#include "scheduler/cli/commands.h"
#include "scheduler/cli/parse.h"
#include "scheduler/cli/programs.h"
#include "scheduler/cli/stop_signal.h"
#include "scheduler/cli/worker_pool.h"
#include "scheduler/store/sqlite.h"
#include "schema/base/clock.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/json.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr int kLeaseMs = 3000, kPollMs = 20, kWorkerRamMb = 1000;
/// Enough that some are left when the first have ended and a process was killed.
constexpr int kJobsPerWorkerToKill = 500;

struct BenchOptions {
  int num_jobs = 10'000, num_workers = 0;
  std::string folder = fs::temp_directory_path().string();
  bool process = false, json = false;
};

BenchOptions parse_options(const Arguments& arguments) {
  CLI::App app{"Measures a farm of this machine with jobs that do nothing: what a job costs, how fast it recovers.",
               "vantage bench"};
  BenchOptions options;
  app.add_option("--jobs", options.num_jobs, "jobs that do nothing")
      ->check(CLI::Range(100, 1'000'000))
      ->capture_default_str();
  app.add_option("--workers", options.num_workers, "jobs at the same time; 0: one per core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--folder", options.folder, "disk to measure on; a folder is made there, and removed")
      ->check(CLI::ExistingDirectory)
      ->capture_default_str();
  app.add_flag("--process", options.process, "also with a process per job, for a tenth of the jobs");
  app.add_flag("--json", options.json, "for programs");
  parse(app, arguments);
  if (options.num_workers == 0)
    options.num_workers = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  return options;
}

/// A folder that goes with all that is in it.
class Folder {
 public:
  explicit Folder(const fs::path& parent) {
    std::string pattern = (fs::absolute(parent) / "vantage-bench-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr)
      throw Error(ErrorKind::BadInput,
                  fmt::format("{}: cannot be written; name another disk with --folder", parent.string()));
    path_ = pattern;
  }
  ~Folder() {
    std::error_code ignored;  // a left-over folder in the place for temporary ones
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

class Bench {
 public:
  explicit Bench(const BenchOptions& options)
      : options_(options), folder_(options.folder), scheduler_(folder_.path() / "farm", kLeaseMs) {
    fs::create_directories(scheduler_.state_dir());
    scheduler_.start();
    workers_.emplace(WorkerPool::Options{.program = sibling_program("vantage-worker"),
                                         .bus_url = scheduler_.bus_url(),
                                         .key_file = scheduler_.key_file(),
                                         .folder = scheduler_.state_dir(),
                                         .num_workers = options.num_workers,
                                         .ram_mb = kWorkerRamMb},
                     system_clock());
    wait_until([&] { return number("SELECT count(*) FROM worker") >= options_.num_workers; }, "the workers to appear");
  }

  Json run() {
    Json all{{"bench", "vantage"}, {"workers", options_.num_workers}, {"lease_ms", kLeaseMs}};
    all["in_worker"] = measure("noop", options_.num_jobs);
    if (options_.process) all["process"] = measure("process", std::max(100, options_.num_jobs / 10));
    all["worker_kill_to_redispatch_ms"] = kill_a_worker();
    all["scheduler_start_to_dispatch_ms"] = restart_scheduler();
    return all;
  }

 private:
  fs::path write_shot(const std::string& kind, int num_jobs) {
    const fs::path shot = folder_.path() / fmt::format("shot{}", ++num_shots_);
    fs::create_directories(shot);
    write_file_atomically(shot / "shot.toml",
                          fmt::format("[[camera]]\nname = \"a\"\nfootage = \"none\"\n"
                                      "[[camera]]\nname = \"b\"\nfootage = \"none\"\n[{}]\nnum_jobs = {}\n",
                                      kind, num_jobs));
    return shot;
  }

  Json measure(const std::string& kind, int num_jobs) {
    const fs::path shot = write_shot(kind, num_jobs);
    const std::int64_t cpu_before_ms = scheduler_.cpu_ms(), bytes_before = database_bytes();
    const std::int64_t start_ms = system_clock().wall_ms();
    scheduler_.submit(shot);
    const std::int64_t submitted_ms = system_clock().wall_ms(), cpu_submit_ms = scheduler_.cpu_ms();
    wait_until([&] { return is_finished(shot); }, "the jobs to end");
    if (text("SELECT state FROM shot WHERE folder = ?", shot.string()) != "done")
      throw Error(ErrorKind::Resource, fmt::format("{} jobs of kind {} did not all end well", num_jobs, kind));
    const std::int64_t first_ms = number(
        "SELECT min(leased_ms) FROM attempt JOIN job ON job.id = job_id JOIN shot ON shot.id = shot_id WHERE folder = "
        "?",
        shot.string());
    const std::int64_t end_ms = number("SELECT finished_ms FROM shot WHERE folder = ?", shot.string());
    const auto per_job = [num_jobs](std::int64_t ms) { return static_cast<double>(ms) / num_jobs; };
    return {{"jobs", num_jobs},
            {"submit_ms_per_job", per_job(submitted_ms - start_ms)},
            {"ms_per_job", per_job(end_ms - first_ms)},
            {"total_ms_per_job", per_job(end_ms - start_ms)},
            {"submit_cpu_ms_per_1000_jobs", 1000 * per_job(cpu_submit_ms - cpu_before_ms)},
            {"scheduler_cpu_ms_per_1000_jobs", 1000 * per_job(scheduler_.cpu_ms() - cpu_submit_ms)},
            {"scheduler_peak_rss_mb", scheduler_.peak_rss_mb()},
            {"database_bytes_per_1000_jobs", 1000 * per_job(database_bytes() - bytes_before)}};
  }

  /// kill -9 of a worker in the middle of its jobs; how long until another one, or its next start, has one of them.
  std::int64_t kill_a_worker() {
    const fs::path shot = write_shot("process", kJobsPerWorkerToKill * options_.num_workers);
    scheduler_.submit(shot);
    wait_for_first_ends();
    const std::int64_t killed_ms = system_clock().wall_ms();
    ::kill(workers_->pids().front(), SIGKILL);
    if (options_.num_workers == 1) workers_->mend();
    std::int64_t again_ms = 0;
    wait_until([&] { return (again_ms = number("SELECT min(leased_ms) FROM attempt WHERE number > 1")) > 0; },
               "its jobs to be given out again");
    workers_->mend();
    wait_until([&] { return is_finished(shot); }, "the jobs to end");
    return again_ms - killed_ms;
  }

  /// kill -9 of the scheduler in the middle of jobs; from its next start to its first new claim.
  std::int64_t restart_scheduler() {
    scheduler_.submit(write_shot("process", kJobsPerWorkerToKill * options_.num_workers));
    wait_for_first_ends();
    scheduler_.kill();
    const std::int64_t start_ms = system_clock().wall_ms();
    scheduler_.start();
    std::int64_t claimed_ms = 0;
    wait_until([&] { return (claimed_ms = number("SELECT max(leased_ms) FROM attempt")) > start_ms; },
               "the scheduler to dispatch again");
    return number("SELECT min(leased_ms) FROM attempt WHERE leased_ms > ?", start_ms) - start_ms;
  }

  void wait_for_first_ends() {
    const std::int64_t before = number("SELECT count(*) FROM attempt WHERE outcome = 'done'");
    wait_until([&] { return number("SELECT count(*) FROM attempt WHERE outcome = 'done'") > before; },
               "the first jobs to end");
  }
  bool is_finished(const fs::path& shot) {
    return number("SELECT finished_ms IS NOT NULL FROM shot WHERE folder = ?", shot.string()) != 0;
  }

  template <class Condition>
  void wait_until(const Condition& condition, const char* what) {
    constexpr std::int64_t kPatienceMs = 3'600'000;
    for (const std::int64_t start_ms = system_clock().monotonic_ms(); !condition();) {
      if (stop_was_asked()) throw Error(ErrorKind::Transient, fmt::format("stopped while waiting for {}", what));
      if (system_clock().monotonic_ms() - start_ms > kPatienceMs)
        throw Error(ErrorKind::Resource, fmt::format("waited an hour for {}", what));
      std::this_thread::sleep_for(std::chrono::milliseconds(kPollMs));
    }
  }

  // A connection per question: none may be open when the scheduler's process is forked.
  template <class... Values>
  std::int64_t number(std::string_view sql, const Values&... values) {
    return open_farm_to_read(scheduler_.state_dir()).integer_or(0, sql, values...);
  }
  template <class... Values>
  std::string text(std::string_view sql, const Values&... values) {
    return open_farm_to_read(scheduler_.state_dir()).text_or("", sql, values...);
  }
  std::int64_t database_bytes() const {
    std::int64_t sum = 0;
    for (const char* name : {"farm.sqlite", "farm.sqlite-wal"})
      if (const fs::path file = scheduler_.state_dir() / name; fs::exists(file))
        sum += static_cast<std::int64_t>(fs::file_size(file));
    return sum;
  }

  BenchOptions options_;
  Folder folder_;
  BenchScheduler scheduler_;
  std::optional<WorkerPool> workers_;
  int num_shots_ = 0;
};

void print_kind(const Json& kind, const char* how) {
  fmt::print("{:>9} jobs, {}:\n", kind.at("jobs").get<int>(), how);
  fmt::print("    {:8.3f} ms per job from first claim to last end; with planning {:.3f} ms\n",
             kind.at("ms_per_job").get<double>(), kind.at("total_ms_per_job").get<double>());
  fmt::print("    {:8.1f} ms of CPU per 1,000 jobs in the scheduler, and {:.1f} ms to plan them\n",
             kind.at("scheduler_cpu_ms_per_1000_jobs").get<double>(),
             kind.at("submit_cpu_ms_per_1000_jobs").get<double>());
  fmt::print("    {:8.1f} MB of database per 1,000 jobs\n",
             kind.at("database_bytes_per_1000_jobs").get<double>() / 1e6);
  fmt::print("    {:8} MB of memory at most in the scheduler\n", kind.at("scheduler_peak_rss_mb").get<int>());
}

void print_text(const Json& all) {
  fmt::print("{} workers; every result is durable before it is believed\n", all.at("workers").get<int>());
  print_kind(all.at("in_worker"), "inside the workers");
  if (all.contains("process")) print_kind(all.at("process"), "a process each");
  fmt::print("Worker killed: its jobs go out again after {:.1f} s (its lease lasts {:.1f} s)\n",
             all.at("worker_kill_to_redispatch_ms").get<double>() / 1000, all.at("lease_ms").get<double>() / 1000);
  fmt::print("Scheduler killed: gives out jobs {:.2f} s after its next start\n",
             all.at("scheduler_start_to_dispatch_ms").get<double>() / 1000);
}

}  // namespace

int bench_command(const Arguments& arguments) {
  const BenchOptions options = parse_options(arguments);
  note_stop_signals();
  if (!options.json) fmt::print(stderr, "Measuring; this takes about {} s…\n", 20 + options.num_jobs / 500);
  const Json all = Bench(options).run();
  if (options.json)
    fmt::print("{}\n", all.dump());
  else
    print_text(all);
  return kExitOk;
}

}  // namespace vantage
