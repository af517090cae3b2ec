#include "tests/protocol/simulation.h"

#include <algorithm>

#include "schema/base/error.h"

namespace vantage {
namespace {

/// Longer than a hung job's limit, three times raised, and every back-off.
constexpr std::int64_t kCalmMs = 600'000;

class Simulation {
 public:
  explicit Simulation(const Schedule& schedule)
      : schedule_(schedule),
        world_(schedule.seed),
        network_(world_, schedule.weather),
        farm_(farm_of_key("a key that all of them have")),
        scheduler_(world_, network_, ledger_, schedule, farm_) {
    for (int w = 0; w < schedule.num_workers; ++w) {
      workers_.push_back(std::make_unique<SimWorker>(
          world_, network_, ledger_,
          SimWorker::Config{.id = fmt::format("w{}", w),
                            .slots = 1 + (schedule.num_slots + w) % 3,
                            .fates = schedule.fates,
                            .farm = farm_,
                            .elsewhere = scheduler_.farm().shot_folder() / "elsewhere",
                            .on_stop = [this](const AttemptRef& ref) { scheduler_.checks().on_stop(ref); }}));
      workers_.back()->start();
    }
  }

  RunResult run() {
    RunResult result;
    try {
      for (const Fault& fault : schedule_.faults) world_.after(fault.at_ms, [this, fault] { commit(fault); });
      while (world_.step(schedule_.faulty_ms)) continue;
      calm_down();
      wait_until_idle();
      scheduler_.checks().at_the_end();
    } catch (const Violation& v) {
      result.violation = v.what();
    } catch (const std::exception& e) {
      result.violation = fmt::format("exception: {}", e.what());
    }
    result.num_killed = scheduler_.num_killed();
    result.num_dropped = scheduler_.num_dropped();
    result.simulated_ms = world_.now_ms();
    result.num_jobs = static_cast<int>(ledger_.num_made.size());
    result.num_attempts = static_cast<int>(ledger_.ends.size());
    if (!result.violation.empty()) world_.note("VIOLATION: {}", result.violation);
    result.trace = world_.trace();
    return result;
  }

 private:
  void commit(const Fault& f) {
    SimWorker& worker = *workers_[f.choice % workers_.size()];
    const std::uint64_t moment = f.choice >> 8U;
    switch (f.kind) {
      case FaultKind::KillScheduler:
        return scheduler_.kill(static_cast<SimScheduler::Death>(moment % SimScheduler::kNumDeaths), f.for_ms);
      case FaultKind::KillWorker:
        return worker.kill(static_cast<SimWorker::Death>(moment % SimWorker::kNumDeaths), f.for_ms);
      case FaultKind::StallScheduler:
        world_.note("scheduler is stopped for {} ms", f.for_ms);
        return scheduler_.stall(f.for_ms);
      case FaultKind::StallWorker:
        return worker.stall(f.for_ms);
      case FaultKind::CutWorkerOff:
        world_.note("{} is cut off for {} ms", worker.id(), f.for_ms);
        return network_.cut_off(worker.id(), f.for_ms);
      case FaultKind::ForgeReport:
        return forge_report(f.choice);
      case FaultKind::ForgeForeign:
        return forge_foreign(worker.id());
      case FaultKind::Resubmit:
        return scheduler_.resubmit();
      default:
        order(f, worker.id());
    }
  }

  void order(const Fault& f, const std::string& worker) {
    using enum Command::Verb;
    Command c;
    c.shot = scheduler_.farm().shot;
    const auto of_worker = [&](Command::Verb verb) { c.verb = verb, c.shot.reset(), c.worker = worker; };
    const auto of_job = [&](Command::Verb verb) { c.verb = verb, c.job = some_job(f.choice >> 8U); };
    switch (f.kind) {
      case FaultKind::Drain:
        of_worker(Drain);
        break;
      case FaultKind::Undrain:
        of_worker(Undrain);
        break;
      case FaultKind::PauseShot:
        c.verb = Pause;
        break;
      case FaultKind::ResumeShot:
        c.verb = Resume;
        break;
      case FaultKind::RetryShot:
        c.verb = Retry;
        break;
      case FaultKind::CancelJob:
        of_job(Cancel);
        break;
      case FaultKind::PauseJob:
        of_job(Pause);
        break;
      case FaultKind::ResumeJob:
        of_job(Resume);
        break;
      default:
        of_job(Retry);
    }
    scheduler_.command(c);
  }
  /// Jobs have small numbers: one that there is, or will be, or not.
  static JobId some_job(std::uint64_t choice) { return {static_cast<std::int64_t>(1 + choice % 16)}; }

  /// Somebody of this farm tells ends of attempts that nobody gave him, with right numbers and wrong tokens.
  void forge_report(std::uint64_t choice) {
    if (!scheduler_.is_up()) return;
    WorkerReport report;
    report.worker_id = "ghost";
    report.incarnation = static_cast<std::int64_t>(choice % 1000) + 1;
    report.seq = ++forged_seq_;
    report.epoch_seen = scheduler_.farm().dispatcher->epoch();
    for (const AttemptRow& open : scheduler_.farm().store->open_attempts()) {
      AttemptRef ref = open.ref;
      ref.token ^= 1 << 20;
      if (choice % 3 == 0) {
        report.running.push_back({ref, "working", 0.1, 1});
        continue;
      }
      const bool done = choice % 3 == 1;
      report.done_unacked.push_back({.ref = ref,
                                     .outcome = done ? Outcome::Done : Outcome::Crashed,
                                     .error_kind = done ? "" : "crash",
                                     .message = "forged",
                                     .content = "forged"});
    }
    world_.note("somebody reports {} attempts that are others'", report.running.size() + report.done_unacked.size());
    for (const auto& d : encode(report, {"ghost", report.incarnation, report.seq}, farm_))
      network_.send("ghost", "scheduler", d);
  }

  /// As another farm would sign, or somebody who has seen our messages but not our key. Both are as good as damaged.
  void forge_foreign(const std::string& worker) {
    WorkerReport report;
    report.worker_id = worker;
    report.incarnation = 1'000'000;
    report.seq = 1;
    Farm guessed = farm_;
    guessed.key = "a key that somebody guessed";
    for (const Farm& farm : {guessed, farm_of_key("the key of another farm")})
      for (const auto& d : encode(report, {worker, report.incarnation, report.seq}, farm))
        network_.send_damaged("ghost", "scheduler", d);
  }

  /// No fault any more, everybody is started again, people take back what they ordered.
  void calm_down() {
    world_.note("calm");
    world_.calm = true;
    scheduler_.start();
    if (schedule_.last_is_lost) workers_.back()->lose();
    for (const auto& worker : workers_) {
      worker->start();
      scheduler_.command({.verb = Command::Verb::Undrain, .worker = worker->id()});
    }
    const ShotId shot = scheduler_.farm().shot;
    scheduler_.command({.verb = Command::Verb::Resume, .shot = shot});
    for (int job = 1; job <= 16; ++job)
      scheduler_.command({.verb = Command::Verb::Resume, .shot = shot, .job = JobId{job}});
  }

  void wait_until_idle() {
    const std::int64_t deadline_ms = world_.now_ms() + kCalmMs;
    while (!is_over()) {
      if (world_.now_ms() >= deadline_ms) throw Violation("the farm does not come to an end:" + what_is_open());
      const std::int64_t until_ms = world_.now_ms() + 500;
      while (world_.step(until_ms)) continue;
    }
  }
  bool is_over() {
    if (!scheduler_.is_up()) return false;
    const auto shot = scheduler_.farm().store->shot(scheduler_.farm().shot);
    if (!shot) return false;
    // What failed or was canceled while there were faults gets its second chance.
    if (shot->state == "failed") scheduler_.command({.verb = Command::Verb::Retry, .shot = shot->id});
    if (shot->state != "done") return false;
    return std::all_of(workers_.begin(), workers_.end(), [](const auto& w) { return w->is_lost() || w->is_idle(); });
  }
  std::string what_is_open() {
    std::string text = scheduler_.checks().what_is_open();
    for (const auto& w : workers_) text += "\n  " + w->what_it_does();
    return text;
  }

  Schedule schedule_;
  World world_;
  Network network_;
  Ledger ledger_;
  Farm farm_;
  SimScheduler scheduler_;
  std::vector<std::unique_ptr<SimWorker>> workers_;
  std::int64_t forged_seq_ = 0;
};

}  // namespace

RunResult run_schedule(const Schedule& schedule) {
  try {
    return Simulation(schedule).run();
  } catch (const Violation& v) {  // already at the start
    return {.violation = v.what(), .trace = {}};
  }
}

Schedule shrink(Schedule schedule) {
  const auto still_fails = [](const Schedule& s) { return !run_schedule(s).violation.empty(); };
  const auto without = [&](auto change) {
    Schedule smaller = schedule;
    change(smaller);
    if (still_fails(smaller)) schedule = smaller;
  };
  for (std::size_t i = schedule.faults.size(); i-- > 0;)
    without([i](Schedule& s) { s.faults.erase(s.faults.begin() + static_cast<std::ptrdiff_t>(i)); });
  for (double Weather::*chance : {&Weather::loss, &Weather::duplicate, &Weather::corrupt, &Weather::replay})
    without([chance](Schedule& s) { s.weather.*chance = 0; });
  without([](Schedule& s) { s.weather.max_delay_ms = 5; });
  for (double Fates::*chance :
       {&Fates::crash, &Fates::fail, &Fates::hang, &Fates::dies_after_commit, &Fates::late_storage})
    without([chance](Schedule& s) { s.fates.*chance = 0; });
  without([](Schedule& s) { s.last_is_lost = false; });
  without([](Schedule& s) { s.num_noops = 0; });
  without([](Schedule& s) { s.num_edges = 1; });
  return schedule;
}

}  // namespace vantage
