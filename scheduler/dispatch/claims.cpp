/// Dispatcher: leases that run out, and which worker gets which job.
#include <fmt/format.h>

#include <algorithm>

#include "scheduler/dispatch/dispatcher.h"
#include "scheduler/dispatch/spec_file.h"
#include "schema/base/error.h"
#include "schema/base/hash.h"

namespace vantage {
namespace {

/// Jobs shorter than this are handed out ahead: the way there and back would show in the total.
constexpr double kPrefetchBelowMs = 2'000;
/// So much work ahead per slot bridges a slow commit and a lost message.
constexpr double kPrefetchMs = 200;
constexpr double kMaxAheadPerSlot = 256;
/// A worker with less room than this would only fail.
constexpr int kMinFreeDiskMb = 100;
/// What no event tells, such as the clock, is looked at this often.
constexpr std::int64_t kClaimMs = 100;
/// Before a folder that could not be written is tried again.
constexpr std::int64_t kTroubleMs = 1'000;

void make_folder_of(const std::filesystem::path& file) {
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  if (error)
    throw Error(ErrorKind::Resource,
                fmt::format("{}: cannot be made: {}", file.parent_path().string(), error.message()));
}

}  // namespace

/// What a worker can still take, counted down while jobs are handed out.
struct Dispatcher::Room {
  LiveWorker* worker = nullptr;
  int free_cores = 0, free_ram_mb = 0, largest_cores = 0, largest_ram_mb = 0;
  bool reserved = false;  ///< takes only what must run alone
  bool full = false;
};

void Dispatcher::on_tick(std::int64_t now_ms) {
  stop_revoked();
  expire_leases(now_ms);
  look_at_the_clock();
  test_doubted(now_ms);
  store_.wake_waiting();
  const bool news = may_claim_ || store_.num_woken() != num_woken_seen_ || now_ms >= next_claim_ms_;
  if (!news) return;
  may_claim_ = false;
  num_woken_seen_ = store_.num_woken();
  next_claim_ms_ = now_ms + kClaimMs;
  try {
    trouble_.clear();
    claim_for_all(now_ms);
  } catch (const DatabaseError&) {
    throw;
  } catch (const Error& e) {  // the shot's folder cannot be written: nothing of this claim was, the rest goes on
    if (e.kind() == ErrorKind::Bug) throw;
    trouble_ = e.what();
    next_claim_ms_ = now_ms + kTroubleMs;
  }
}

void Dispatcher::expire_leases(std::int64_t now_ms) {
  for (auto& [id, worker] : workers_) {
    std::vector<AttemptRef> expired;
    for (const auto& [ref, held] : worker.held)
      if (held.lease_until_ms <= now_ms) expired.push_back(ref);
    for (const AttemptRef& ref : expired) lose(worker, ref, "was not heard of: the lease ran out");
    if (worker.seen_ms > 0 && !worker.lost && now_ms - worker.seen_ms >= options_.lease_ms) {
      worker.lost = true;
      store_.set_worker_state(id, "lost");
    }
  }
  stop_revoked();
}

/// Workers that take work and have room for more: as many as they have slots, or some ahead.
std::vector<Dispatcher::Room> Dispatcher::rooms() {
  std::vector<Room> rooms;
  int largest_cores = 0, largest_ram_mb = 0;
  for (auto& [id, worker] : workers_) {
    if (!worker.takes_work()) continue;
    largest_cores = std::max(largest_cores, worker.report.cores);
    largest_ram_mb = std::max(largest_ram_mb, worker.report.ram_mb);
    const bool disk_full = worker.report.free_disk_mb > 0 && worker.report.free_disk_mb < kMinFreeDiskMb;
    if (disk_full || worker.runs_something_alone()) continue;
    rooms.push_back({.worker = &worker,
                     .free_cores = worker.report.cores - worker.used_cores(),
                     .free_ram_mb = worker.report.ram_mb - worker.used_ram_mb()});
  }
  for (Room& room : rooms) room.largest_cores = largest_cores, room.largest_ram_mb = largest_ram_mb;
  return rooms;
}

/// First every free slot of every worker, round by round so that work spreads; then some ahead. While a job waits to
/// run alone, the first worker takes nothing else until it is empty.
void Dispatcher::claim_for_all(std::int64_t now_ms) {
  std::vector<Room> with_room = rooms();
  if (with_room.empty()) return;
  ReadyJobs ready(store_);
  if (ready.empty()) return;
  if (const ReadyClass* lone = ready.first_to_run_alone()) reserve_for(*lone, with_room);
  for (const Claim claim : {Claim::Run, Claim::Prefetch}) {
    for (Room& room : with_room) room.full = room.reserved;
    for (bool again = true; again;) {
      again = false;
      for (Room& room : with_room) {
        if (!room.full) room.full = !claim_one(room, claim, ready, now_ms);
        again |= !room.full;
      }
    }
  }
}

int Dispatcher::num_ahead_per_slot(const std::string& kind) const {
  const auto mean = mean_wall_ms_.find(kind);
  if (mean == mean_wall_ms_.end() || mean->second >= kPrefetchBelowMs) return 0;
  return static_cast<int>(std::clamp(kPrefetchMs / std::max(mean->second, 1e-3), 1.0, kMaxAheadPerSlot));
}

/// A job that asks for more than any worker has gets the whole of one.
bool Dispatcher::suits(const Room& room, Claim claim, const ReadyClass& ready) const {
  const LiveWorker& worker = *room.worker;
  const Wanted wanted{.kind = ready.kind, .pool = ready.pool, .tags = ready.tags};
  if (!worker.serves(wanted) || avoids(worker, wanted)) return false;
  const auto slots = static_cast<std::size_t>(worker.report.slots);
  const auto num_ahead = claim == Claim::Run ? 0U : static_cast<std::size_t>(num_ahead_per_slot(ready.kind));
  if (worker.held.size() >= slots * (1 + num_ahead)) return false;
  if (ready.alone && !worker.held.empty()) return false;
  const int free_cores = claim == Claim::Run ? room.free_cores : worker.report.cores;
  const int free_ram_mb = claim == Claim::Run ? room.free_ram_mb : worker.report.ram_mb;
  return std::min(ready.cores, room.largest_cores) <= free_cores &&
         std::min(ready.ram_mb, room.largest_ram_mb) <= free_ram_mb;
}

/// While a shot's storage is in trouble its jobs wait, and the first of them says for what.
bool Dispatcher::can_be_stored(const ReadyClass& ready, std::int64_t now_ms) {
  const std::string& trouble = storage_.trouble(ready.shot, now_ms);
  if (trouble.empty()) {
    told_trouble_.erase(ready.shot);
    return true;
  }
  if (std::exchange(told_trouble_[ready.shot], trouble) != trouble) {
    store_.set_error(ready.first, std::string(to_string(ErrorKind::Transient)), trouble);
    store_.add_event(ready.shot, ready.first, "", "warning", trouble);
    planner_.touch(ready.shot);
  }
  return false;
}

/// What a single job adds to its class.
bool Dispatcher::suits(const LiveWorker& worker, const JobRow& job) const {
  if (!worker.offers(job.kind, job.version)) return false;
  return !avoids(worker, {.kind = job.kind, .pool = job.pool, .tags = job.tags, .version = job.version, .job = job.id});
}

/// The first worker that may run a job which must be alone takes nothing else until it is empty.
void Dispatcher::reserve_for(const ReadyClass& lone, std::vector<Room>& rooms) const {
  const Wanted wanted{.kind = lone.kind, .pool = lone.pool, .tags = lone.tags, .job = lone.first};
  const auto room = std::find_if(rooms.begin(), rooms.end(),
                                 [&](const Room& r) { return r.worker->serves(wanted) && !avoids(*r.worker, wanted); });
  if (room != rooms.end()) room->reserved = !room->worker->held.empty();
}

/// False when the worker has no room for anything that is ready.
bool Dispatcher::claim_one(Room& room, Claim claim, ReadyJobs& ready, std::int64_t now_ms) {
  if (room.worker->runs_something_alone()) return false;
  const auto job = ready.take([&](const ReadyClass& r) { return suits(room, claim, r) && can_be_stored(r, now_ms); },
                              [&](const JobRow& j) { return suits(*room.worker, j); });
  if (!job) return false;
  if (!hand_out(*room.worker, *job, now_ms)) return true;
  room.free_cores -= std::min(job->cores, room.worker->report.cores);
  room.free_ram_mb -= std::min(job->ram_mb, room.worker->report.ram_mb);
  return true;
}

/// The job leaves the state ready: for the worker, or, when its result or its footage say otherwise, for another state.
bool Dispatcher::hand_out(LiveWorker& worker, const JobRow& job, std::int64_t now_ms) {
  if (job.num_attempts > 0 && planner_.salvage(job, JobState::Skipped, "a lost attempt had finished it")) return false;
  if (!planner_.move_suspect_aside(job)) return false;
  const bool in_worker = planner_.runs_in_worker(job.kind);
  const std::string log_path =
      in_worker
          ? ""
          : (planner_.private_folder(job.shot) / "logs" / fmt::format("{}.{}.log", job.name, job.num_attempts + 1))
                .string();
  AttemptRef ref{.job_id = job.id.value, .number = job.num_attempts + 1};
  ref.token = static_cast<std::int64_t>(options_.random() >> 1U);
  try {
    if (!planner_.key_holds(job)) {  // footage was replaced since the job became ready
      planner_.recheck(job);
      return false;
    }
  } catch (const DatabaseError&) {
    throw;
  } catch (const Error& e) {
    if (e.kind() == ErrorKind::Bug) throw;
    planner_.recheck(job);
    return false;
  }
  Held held = held_of(job, ref, log_path, Spec::Write, now_ms);
  if (!in_worker) make_folder_of(log_path);
  store_.begin_attempt(job, ref, worker.report.worker_id, log_path);
  worker.held.insert_or_assign(ref, std::move(held));
  worker.changed = true;
  ++num_claimed_;
  planner_.touch(job.shot);
  return true;
}

Held Dispatcher::held_of(const JobRow& job, const AttemptRef& ref, const std::string& log_path, Spec spec,
                         std::int64_t now_ms) {
  Held held;
  held.assignment = {.ref = ref,
                     .spec_path = {},
                     .spec_hash = {},
                     .log_path = log_path,
                     .cores = job.cores,
                     .ram_mb = job.ram_mb,
                     .timeout_s = job.timeout_s,
                     .kind = fmt::format("{}/{}", job.kind, job.version)};
  give_spec(job, spec, held.assignment);
  held.shot = job.shot;
  held.kind = job.kind;
  held.key = job.key;
  held.claimed_ms = now_ms;
  held.lease_until_ms = now_ms + options_.lease_ms;
  held.alone = job.num_crashes > 0;
  return held;
}

/// What runs inside the worker needs no more than fits into the orders.
void Dispatcher::give_spec(const JobRow& job, Spec spec, Assignment& assignment) {
  if (planner_.runs_in_worker(job.kind)) {
    assignment.spec = fmt::format(R"({{"params":{},"unit":{}}})", job.params, job.unit);
    return;
  }
  const auto path = planner_.private_folder(job.shot) / "specs" / (job.name + ".json");
  assignment.spec_path = path.string();
  const std::string text = spec_text(planner_.job_file(job));
  assignment.spec_hash = hash_bytes(text);
  if (spec == Spec::Write) write_spec_file(path, text);
}

}  // namespace vantage
