#pragma once
/// A farm without machines: the real database, planner and dispatcher, with a clock that tests set, a bus that only
/// remembers, and workers that "run" a job by writing its artifact. Nothing sleeps.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "jobs/all_jobs.h"
#include "scheduler/dispatch/dispatcher.h"
#include "scheduler/plan/planner.h"
#include "scheduler/store/store.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "schema/formats/job_file.h"
#include "schema/formats/manifest.h"
#include "tests/support/temporary_folder.h"

namespace vantage {

class FakeClock final : public Clock {
 public:
  std::int64_t monotonic_ms() const override { return now_ms; }
  std::int64_t wall_ms() const override { return 1'700'000'000'000 + now_ms; }
  std::int64_t now_ms = 1'000;
};

/// Keeps the newest orders for each worker, and how many were sent.
class FakeBus final : public Bus {
 public:
  void send(const WorkerOrders& orders) override { sent[orders.worker_id].push_back(orders); }
  void send(const SchedulerHello& message) override { hello = message; }
  std::map<std::string, std::vector<WorkerOrders>> sent;
  std::optional<SchedulerHello> hello;
};

/// Does what a job file says, as a worker's child would: the artifact's one file tells what it was made from, but for
/// "calibrate", whose result is the same for all params.sigma of one whole part. noise: what else it came to depend on.
/// Returns the content hash.
inline std::string make_artifact(const JobFile& job, const std::string& noise = "") {
  const auto folder = artifact_folder(job.store, job.kind, job.key);
  std::filesystem::create_directories(folder);
  Json made{{"job", job.job}, {"params", job.params}, {"unit", job.unit}};
  if (job.kind == "calibrate") made["params"] = {{"sigma", static_cast<int>(job.params.at("sigma").get<double>())}};
  for (const auto& [name, input] : job.inputs) made["inputs"][name] = input.content;
  for (const auto& [name, source] : job.sources) made["sources"][name] = source.content;
  if (!noise.empty()) made["noise"] = noise;
  write_json(folder / "out.json", made);
  Manifest m{.kind = job.kind, .version = job.version, .job = job.job, .key = job.key, .content = "", .files = {}};
  m.files = list_artifact_files(folder);
  m.content = content_hash(m.files);
  write_manifest(folder, m);
  return m.content;
}

/// A worker that takes its orders at once and runs what it holds when told to.
class FakeWorker {
 public:
  FakeWorker(std::string id, int slots) {
    report_.worker_id = std::move(id);
    report_.incarnation = 1;
    report_.host = "host";
    report_.slots = report_.cores = slots;
    report_.ram_mb = 8000;
    report_.free_disk_mb = 50'000;
  }
  const std::string& id() const { return report_.worker_id; }

  void take(const WorkerOrders& orders) {
    if (orders.incarnation != report_.incarnation) return;
    if (std::pair(orders.epoch, orders.seq) <= std::pair(report_.epoch_seen, report_.orders_seq_seen)) return;
    report_.epoch_seen = orders.epoch;
    report_.orders_seq_seen = orders.seq;
    const auto listed = [](const auto& refs, const AttemptRef& ref) {
      return std::find(refs.begin(), refs.end(), ref) != refs.end();
    };
    std::erase_if(report_.done_unacked, [&](const DoneAttempt& d) { return listed(orders.acked, d.ref); });
    std::set<AttemptRef> wanted;
    for (const Assignment& a : orders.assigned) wanted.insert(a.ref);
    std::erase_if(held_, [&](const auto& entry) {
      return listed(orders.canceled, entry.first) || (!orders.reconciling && !wanted.contains(entry.first));
    });
    for (const Assignment& a : orders.assigned)
      if (!finished_.contains(a.ref)) held_.emplace(a.ref, a);
  }
  /// What it says of itself, for tests to change.
  WorkerReport& machine() { return report_; }
  std::int64_t epoch_seen() const { return report_.epoch_seen; }
  /// Whole state, as it is now.
  WorkerReport report() {
    ++report_.seq;
    report_.running.clear();
    for (const auto& [ref, assignment] : held_) report_.running.push_back({ref, "working", 0.5, 100});
    return report_;
  }
  const std::map<AttemptRef, Assignment>& held() const { return held_; }

  /// Commits the artifact; the result is reported from now on. Returns the job's name.
  std::string finish(const AttemptRef& ref, const std::string& noise = "") {
    const JobFile job = read_job_file(held_.at(ref).spec_path);
    end(ref, {.ref = ref,
              .outcome = Outcome::Done,
              .error_kind = "",
              .message = "",
              .content = make_artifact(job, noise),
              .wall_ms = 5000});
    num_runs[job.job]++;
    return job.job;
  }
  void fail(const AttemptRef& ref, Outcome outcome, ErrorKind kind, const std::string& message) {
    end(ref, {.ref = ref,
              .outcome = outcome,
              .error_kind = std::string(to_string(kind)),
              .message = message,
              .content = ""});
  }
  /// kill -9 and a start by its keeper: what ran is gone; what was done stands in the outbox.
  void restart() {
    held_.clear();
    finished_.clear();
    ++report_.incarnation;
    report_.seq = report_.epoch_seen = report_.orders_seq_seen = 0;
  }
  std::map<std::string, int> num_runs;  ///< by job name: artifacts made

 private:
  void end(const AttemptRef& ref, DoneAttempt done) {
    held_.erase(ref);
    finished_.insert(ref);
    report_.done_unacked.push_back(std::move(done));
  }
  WorkerReport report_;
  std::map<AttemptRef, Assignment> held_;
  std::set<AttemptRef> finished_;
};

/// A shot of two cameras and a pipeline of made-up kinds:
/// ingest/<camera> → calibrate (sigma) → navspace → correspond/<edge> → encode (gain).
class FakeFarm {
 public:
  static constexpr int kLeaseMs = 15'000;

  FakeFarm() {
    std::filesystem::create_directories(shot_folder());
    write_file_atomically(shot_folder() / "a.mp4", "footage a");
    write_file_atomically(shot_folder() / "b.mp4", "footage b");
    write_file_atomically(shot_folder() / "shot.toml",
                          "[shot]\nname = \"fake\"\n[[camera]]\nname = \"a\"\nfootage = \"a.mp4\"\n"
                          "[[camera]]\nname = \"b\"\nfootage = \"b.mp4\"\n");
    kinds = {kind("ingest", [](const ShotState& s) { return ingest(s); }),
             kind("calibrate", [this](const ShotState&) { return calibrate(); }),
             kind("navspace", [this](const ShotState&) { return navspace(); }),
             kind("correspond", [this](const ShotState& s) { return correspond(s); }),
             kind("encode", [this](const ShotState& s) { return encode(s); })};
    start();
  }

  // What tests turn.
  double sigma = 1.2, gain = 1;
  int num_edges = 3;
  int lease_ms = kLeaseMs;  ///< from the next start() on
  std::vector<KindEntry> kinds;
  std::function<void()> before_commit = [] {};  ///< a throw is a death with the transaction open: kill() then

  FakeClock clock;
  FakeBus bus;
  Bus* out = &bus;  ///< where flush sends
  std::unique_ptr<Store> store;
  std::unique_ptr<Planner> planner;
  std::unique_ptr<Dispatcher> dispatcher;
  ShotId shot;

  std::filesystem::path shot_folder() const { return folder_.path() / "shot"; }
  std::filesystem::path database() const { return folder_.path() / "farm.sqlite"; }

  /// Also after kill(): as a new process would.
  void start() {
    store = std::make_unique<Store>(database(), clock);
    store->db().script("PRAGMA synchronous = OFF");  // processes die in these tests, the power does not
    planner = std::make_unique<Planner>(*store, kinds);
    dispatcher = std::make_unique<Dispatcher>(
        *store, *planner, Dispatcher::Options{.farm_id = "f", .lease_ms = lease_ms, .random = [this] {
                                                return 0x9e3779b97f4a7c15ULL * ++random_;
                                              }});
    store->begin();
    dispatcher->recover(clock.now_ms);
    store->commit();
  }
  /// kill -9: nothing in memory survives, nor does what was not committed.
  void kill() {
    dispatcher.reset();
    planner.reset();
    store.reset();
  }
  Planner::Submitted submit(const std::string& until = "") {
    Planner::Submitted result;
    turn([&] { store->guarded([&] { result = planner->submit(shot_folder(), until, 0); }); });
    shot = result.shot.id;
    return result;
  }
  /// One turn of the scheduler's thread.
  void turn(const std::function<void()>& work = [] {}) {
    store->begin();
    try {
      work();
    } catch (...) {
      store->rollback();
      throw;
    }
    planner->expand_one();
    dispatcher->on_tick(clock.now_ms);
    planner->end_finished_shots();
    before_commit();
    store->commit();
    dispatcher->flush(*out, "", clock.now_ms);
  }
  void report(const WorkerReport& r) {
    turn([&] { dispatcher->on_report(r, clock.now_ms); });
  }
  /// The worker reports, then takes the newest orders; first once more, when it has not heard of this epoch.
  void sync(FakeWorker& worker) {
    if (worker.epoch_seen() != dispatcher->epoch()) talk(worker);
    talk(worker);
  }
  void talk(FakeWorker& worker) {
    report(worker.report());
    const auto found = bus.sent.find(worker.id());
    if (found != bus.sent.end()) worker.take(found->second.back());
  }
  CommandResult command(const Command& c) {
    CommandResult result;
    turn([&] { result = dispatcher->on_command(c); });
    return result;
  }
  /// Runs everything with one good worker until the shot ends. Returns the jobs that ran, in order.
  std::vector<std::string> run_to_end(FakeWorker& worker, int max_rounds = 200) {
    std::vector<std::string> ran;
    for (int round = 0; round < max_rounds && store->shot(shot)->state == "running"; ++round) {
      clock.now_ms += 100;
      sync(worker);
      if (!worker.held().empty()) ran.push_back(worker.finish(worker.held().begin()->first));
    }
    return ran;
  }
  JobRow job(const std::string& name) { return store->find_job(shot, name).value(); }
  JobState state(const std::string& name) { return job(name).state; }
  int num_attempts(const std::string& name) { return job(name).num_attempts; }

 private:
  static KindEntry kind(std::string_view name, std::function<std::vector<WorkUnit>(const ShotState&)> split) {
    return {.spec = {.name = name, .version = 1, .reads = "", .publishes = "out.json"},
            .split = std::move(split),
            .check = [](const Shot&) {},
            .params = [] { return std::vector<ParamDoc>{}; }};
  }
  static WorkUnit unit(const std::string& name, std::vector<std::string> needs) {
    WorkUnit u;
    u.name = name;
    u.unit = {{"name", name}};
    u.needs = std::move(needs);
    u.need = {.cores = 1, .ram_mb = 1000, .timeout_s = 60};
    return u;
  }
  static std::vector<WorkUnit> ingest(const ShotState& s) {
    std::vector<WorkUnit> units;
    for (const auto& camera : s.shot().cameras) {
      WorkUnit u = unit("ingest/" + camera.name, {});
      u.sources = {{"footage", s.shot().folder / camera.footage}};
      units.push_back(std::move(u));
    }
    return units;
  }
  std::vector<WorkUnit> calibrate() const {
    WorkUnit u = unit("calibrate", {"ingest/a", "ingest/b"});
    u.params = {{"sigma", sigma}};
    u.links = {{"./", "calibration/"}};
    return {u};
  }
  std::vector<WorkUnit> navspace() const { return {unit("navspace", {"calibrate"})}; }
  std::vector<WorkUnit> correspond(const ShotState& s) const {
    std::vector<WorkUnit> units;
    if (!s.artifact("navspace")) return units;
    for (int i = 0; i < num_edges; ++i) {
      units.push_back(unit(fmt::format("correspond/{}", i), {"navspace"}));
      units.back().links = {{"out.json", fmt::format("flow/{}.json", i)}};
    }
    return units;
  }
  std::vector<WorkUnit> encode(const ShotState& s) const {
    std::vector<std::string> needs;
    for (const auto& u : correspond(s)) needs.push_back(u.name);
    if (needs.empty()) return {};
    WorkUnit u = unit("encode", needs);
    u.params = {{"gain", gain}};
    return {u};
  }

  TemporaryFolder folder_;
  std::uint64_t random_ = 0;
};

}  // namespace vantage
