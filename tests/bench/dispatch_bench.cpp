/// Cost of dispatching: the real database (on disk, synchronous = FULL), planner and dispatcher, with a worker that
/// finishes at once whatever it is given. No network, no processes: what is left is the scheduler.
///
///   dispatch_bench [JOBS] [SHOTS] [FOLDER]     prints one JSON line; times are CPU of this thread and wall clock
#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <ctime>
#include <fstream>
#include <unordered_map>

#include "jobs/job_kind.h"
#include "scheduler/dispatch/dispatcher.h"
#include "schema/base/clock.h"
#include "schema/base/files.h"
#include "schema/base/json.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

double wall_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
double cpu_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
std::int64_t peak_rss_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss / 1024;
}

/// Takes all that it is assigned and reports it done, as a worker with jobs that take no time.
class InstantWorker final : public Bus {
 public:
  explicit InstantWorker(int slots) {
    report_.worker_id = "bench";
    report_.incarnation = 1;
    report_.host = "bench";
    report_.slots = report_.cores = slots;
    report_.ram_mb = 64'000;
  }
  void send(const SchedulerHello&) override {}
  void send(const WorkerOrders& orders) override {
    report_.epoch_seen = orders.epoch;
    report_.orders_seq_seen = orders.seq;
    for (const AttemptRef& ref : orders.acked) done_.erase(ref.job_id);
    for (const Assignment& a : orders.assigned)
      if (done_.try_emplace(a.ref.job_id, a.ref).second) ++num_done;
  }
  const WorkerReport& report() {
    ++report_.seq;
    report_.done_unacked.clear();
    for (const auto& [job, ref] : done_) {
      report_.done_unacked.emplace_back();
      report_.done_unacked.back().ref = ref;
      report_.done_unacked.back().content = kNothingPublished;
    }
    return report_;
  }
  std::int64_t num_done = 0;

 private:
  WorkerReport report_;
  std::unordered_map<std::int64_t, AttemptRef> done_;
};

KindEntry noop_kind(int num_jobs) {
  const auto split = [num_jobs](const ShotState&) {
    std::vector<WorkUnit> units(static_cast<std::size_t>(num_jobs));
    for (std::size_t i = 0; i < units.size(); ++i) {
      units[i].name = fmt::format("noop/{}", i);
      units[i].unit = {{"index", i}};
      units[i].need = {.cores = 1, .ram_mb = 10, .timeout_s = 60};
    }
    return units;
  };
  return {.spec = {.name = "noop", .version = 1, .reads = "", .publishes = "", .in_worker = true},
          .split = split,
          .check = [](const Shot&) {},
          .params = [] { return std::vector<ParamDoc>{}; }};
}

std::filesystem::path write_shot(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  for (const auto* name : {"a.mp4", "b.mp4"}) write_file_atomically(folder / name, "footage");
  write_file_atomically(folder / "shot.toml",
                        "[shot]\nname = \"bench\"\n[[camera]]\nname = \"a\"\nfootage = \"a.mp4\"\n"
                        "[[camera]]\nname = \"b\"\nfootage = \"b.mp4\"\n");
  return folder;
}

/// Wall and CPU seconds since the last call.
class Lap {
 public:
  std::pair<double, double> take() {
    const double wall = wall_s(), cpu = cpu_s();
    const std::pair spent{wall - wall_, cpu - cpu_};
    wall_ = wall, cpu_ = cpu;
    return spent;
  }

 private:
  double wall_ = wall_s(), cpu_ = cpu_s();
};

int run(int num_jobs, int num_shots, const std::filesystem::path& folder) {
  const Clock& clock = system_clock();
  const std::vector<KindEntry> kinds{noop_kind(num_jobs / num_shots)};
  std::uint64_t random = 0;
  const Dispatcher::Options options{.farm_id = "bench", .random = [&] { return ++random; }};
  InstantWorker worker(2);
  Json out{{"jobs", num_jobs}, {"shots", num_shots}};
  Lap lap;
  {
    Store store(folder / "farm.sqlite", clock);
    Planner planner(store, kinds);
    Dispatcher dispatcher(store, planner, options);
    store.begin();
    dispatcher.recover(clock.monotonic_ms());
    store.commit();
    lap.take();
    for (int i = 0; i < num_shots; ++i) {
      const auto shot = write_shot(folder / fmt::format("shot{}", i));
      store.begin();
      store.guarded([&] { planner.submit(shot, "", 0); });
      store.commit();
      store.keep_journal_short();
    }
    const auto [submit_wall, submit_cpu] = lap.take();
    out["submit_s"] = submit_wall;
    out["submit_cpu_us_per_job"] = 1e6 * submit_cpu / num_jobs;
  }
  Store store(folder / "farm.sqlite", clock);
  Planner planner(store, kinds);
  Dispatcher dispatcher(store, planner, options);
  store.begin();
  dispatcher.recover(clock.monotonic_ms());
  store.commit();
  std::vector<double> wall_us, cpu_us;  // of every 10,000 jobs
  std::int64_t num_turns = 0, next_mark = 10'000;
  double restart_s = 0;
  for (bool first = true; worker.num_done < num_jobs; ++num_turns) {
    store.begin();
    dispatcher.on_report(worker.report(), clock.monotonic_ms());
    if (!first || num_turns > 2) planner.expand_one();
    dispatcher.on_tick(clock.monotonic_ms());
    planner.end_finished_shots();
    store.commit();
    dispatcher.flush(worker, "", clock.monotonic_ms());
    planner.take_effects();
    store.keep_journal_short();
    if (first && worker.num_done > 0) {
      first = false;
      restart_s = lap.take().first;
    }
    for (; worker.num_done >= next_mark; next_mark += 10'000) {
      const auto [wall, cpu] = lap.take();
      wall_us.push_back(wall * 100);
      cpu_us.push_back(cpu * 100);
    }
  }
  store.begin();
  dispatcher.on_report(worker.report(), clock.monotonic_ms());
  planner.end_finished_shots();
  store.commit();
  out["restart_s"] = restart_s;
  out["turns"] = num_turns;
  out["wall_us_per_job"] = wall_us;
  out["cpu_us_per_job"] = cpu_us;
  out["rss_mb"] = peak_rss_mb();
  out["database_bytes_per_job"] =
      std::filesystem::file_size(folder / "farm.sqlite") / static_cast<std::size_t>(num_jobs);
  out["done"] = store.db().integer_or(0, "SELECT count(*) FROM job WHERE state = 'done'");
  fmt::print("{}\n", out.dump());
  return 0;
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  const int num_jobs = argc > 1 ? std::stoi(argv[1]) : 100'000, num_shots = argc > 2 ? std::stoi(argv[2]) : 1;
  if (argc > 3) return vantage::run(num_jobs, num_shots, argv[3]);
  const vantage::TemporaryFolder folder;
  return vantage::run(num_jobs, num_shots, folder.path());
}
