/// Many workers that report every second through the real broker: what the scheduler's process (with the broker in it)
/// costs for each of them. The workers are real agents and real connections; their jobs take time but do nothing.
///
///   fleet_bench [WORKERS] [SECONDS] [JOB_SECONDS]     prints one JSON line; imitates a large studio's night
///
/// Once with nothing to do, once with every slot busy.
#include <fmt/format.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "jobs/job_kind.h"
#include "scheduler/cli/bench_scheduler.h"
#include "scheduler/store/sqlite.h"
#include "schema/base/clock.h"
#include "schema/base/files.h"
#include "schema/base/json.h"
#include "schema/messages/endpoint.h"
#include "tests/support/temporary_folder.h"
#include "worker/agent.h"

namespace vantage {
namespace {

constexpr std::int64_t kReportEveryMs = 1000, kListenEveryMs = 100;
constexpr int kSlots = 2;
constexpr double kWarmUpS = 5;

std::int64_t now_ms() { return system_clock().monotonic_ms(); }
void wait(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

class SimulatedWorker {
 public:
  SimulatedWorker(const std::string& url, const Farm& farm, int index, std::int64_t job_ms)
      : agent_(config_of(index), {}),
        endpoint_({.url = url,
                   .farm = farm,
                   .role = LcmEndpoint::Role::Worker,
                   .sender = config_of(index).worker_id,
                   .incarnation = 1}),
        job_ms_(job_ms),
        next_ms_(now_ms() + index % kReportEveryMs),
        next_report_ms_(next_ms_) {}

  void work() {
    if (now_ms() < next_ms_) return;
    next_ms_ += kListenEveryMs;
    for (const Message& message : endpoint_.take())
      if (const auto* orders = std::get_if<WorkerOrders>(&message)) start(agent_.on_orders(*orders, now_ms()));
    for (std::size_t i = running_.size(); i-- > 0;) {
      if (running_[i].second > now_ms()) continue;
      end(running_[i].first);
      running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(i));
    }
    if (now_ms() < next_report_ms_) return;
    next_report_ms_ += kReportEveryMs;
    endpoint_.publish(agent_.report({.now_ms = now_ms(), .free_disk_mb = 100'000, .wall_ms = system_clock().wall_ms()}));
  }

 private:
  static AgentConfig config_of(int index) {
    AgentConfig config;
    config.worker_id = fmt::format("simulated-{}", index);
    config.incarnation = 1;
    config.host = fmt::format("host-{}", index);
    config.slots = config.cores = kSlots;
    config.ram_mb = 8000;
    config.kinds = {"process/1"};
    return config;
  }
  void start(const Actions& actions) {
    for (const Assignment& a : actions.start) running_.emplace_back(a.ref, now_ms() + job_ms_);
  }
  void end(const AttemptRef& ref) {
    ChildExit exit;
    exit.ref = ref;
    exit.has_outcome = true;
    exit.outcome.ref = ref;
    exit.outcome.content = kNothingPublished;
    exit.wall_ms = job_ms_;
    start(agent_.on_child_exit(exit, now_ms()));
  }

  Agent agent_;
  LcmEndpoint endpoint_;
  std::int64_t job_ms_, next_ms_, next_report_ms_;
  std::vector<std::pair<AttemptRef, std::int64_t>> running_;
};

/// A connection takes several file descriptors at each end.
void raise_descriptor_limit() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

/// Processes of so many workers each: LCM's select() knows no descriptor above 1023.
constexpr int kWorkersPerProcess = 100;

class Fleet {
 public:
  Fleet(const BenchScheduler& scheduler, int num_workers, std::int64_t job_ms) {
    for (int first = 0; first < num_workers; first += kWorkersPerProcess) {
      const pid_t pid = fork();
      if (pid == 0) work_for_ever(scheduler, first, std::min(num_workers, first + kWorkersPerProcess), job_ms);
      if (pid > 0) processes_.push_back(pid);
    }
  }
  ~Fleet() {
    for (const pid_t pid : processes_) {
      kill(pid, SIGKILL);
      waitpid(pid, nullptr, 0);
    }
  }
  Fleet(const Fleet&) = delete;
  Fleet& operator=(const Fleet&) = delete;

 private:
  [[noreturn]] static void work_for_ever(const BenchScheduler& scheduler, int first, int end, std::int64_t job_ms) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const Farm farm = read_farm_key(scheduler.key_file());
    std::vector<std::unique_ptr<SimulatedWorker>> workers;
    for (int i = first; i < end; ++i)
      workers.push_back(std::make_unique<SimulatedWorker>(scheduler.bus_url(), farm, i, job_ms));
    for (;;) {
      for (const auto& worker : workers) worker->work();
      wait(0.005);
    }
  }
  std::vector<pid_t> processes_;
};

/// Share of one core that the scheduler's process takes.
double cores_taken(const BenchScheduler& scheduler, double seconds) {
  const std::int64_t cpu_ms = scheduler.cpu_ms(), start_ms = now_ms();
  wait(seconds);
  return static_cast<double>(scheduler.cpu_ms() - cpu_ms) / static_cast<double>(now_ms() - start_ms);
}

std::filesystem::path write_shot(const std::filesystem::path& folder, int num_jobs) {
  std::filesystem::create_directories(folder);
  write_file_atomically(folder / "shot.toml",
                        fmt::format("[[camera]]\nname = \"a\"\nfootage = \"none\"\n[[camera]]\nname = \"b\"\n"
                                    "footage = \"none\"\n[process]\nnum_jobs = {}\n",
                                    num_jobs));
  return folder;
}

int run(int num_workers, double seconds, double job_s) {
  raise_descriptor_limit();
  spdlog::set_level(spdlog::level::err);
  const TemporaryFolder folder;
  BenchScheduler scheduler(folder.path() / "farm", 15'000);
  std::filesystem::create_directories(scheduler.state_dir());
  scheduler.start();
  const Fleet fleet(scheduler, num_workers, static_cast<std::int64_t>(1000 * job_s));
  wait(kWarmUpS);
  const auto number = [&](std::string_view sql) { return open_farm_to_read(scheduler.state_dir()).integer_or(0, sql); };
  const std::int64_t num_known = number("SELECT count(*) FROM worker WHERE state = 'active'");
  Json out{{"bench", "fleet"}, {"workers", num_workers}, {"workers_known", num_known}, {"job_s", job_s}};
  out["idle_cores"] = cores_taken(scheduler, seconds);
  const int num_jobs = static_cast<int>(num_workers * kSlots * ((2 * seconds + 10) / job_s + 2));
  scheduler.submit(write_shot(folder.path() / "shot", num_jobs));
  wait(kWarmUpS);
  const std::int64_t done_before = number("SELECT count(*) FROM job WHERE state = 'done'");
  out["busy_cores"] = cores_taken(scheduler, seconds);
  out["jobs_per_s"] =
      static_cast<double>(number("SELECT count(*) FROM job WHERE state = 'done'") - done_before) / seconds;
  out["attempts_lost"] = number("SELECT count(*) FROM attempt WHERE outcome = 'lost'");
  out["scheduler_peak_rss_mb"] = scheduler.peak_rss_mb();
  fmt::print("{}\n", out.dump());
  return 0;
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  const int num_workers = argc > 1 ? std::stoi(argv[1]) : 1000;
  const double seconds = argc > 2 ? std::stod(argv[2]) : 20, job_s = argc > 3 ? std::stod(argv[3]) : 10;
  try {
    return vantage::run(num_workers, seconds, job_s);
  } catch (const std::exception& e) {
    fmt::print(stderr, "fleet_bench: {}\n", e.what());
    return 1;
  }
}
