#include "tests/protocol/sim_worker.h"

#include <signal.h>

#include <algorithm>

#include "schema/base/error.h"
#include "schema/formats/manifest.h"
#include "tests/support/fake_farm.h"

namespace vantage {
namespace {

// As worker_loop.cpp has them.
constexpr std::int64_t kMinReportPauseMs = 5, kReportEveryMs = 1000, kReportUntilHeardMs = 200, kTickEveryMs = 250;
constexpr std::int64_t kFreeRamMb = 16'000;  // of the machine

DoneAttempt failed(const AttemptRef& ref, ErrorKind kind, const std::string& message) {
  return {.ref = ref,
          .outcome = Outcome::Failed,
          .error_kind = std::string(to_string(kind)),
          .message = message,
          .content = ""};
}

}  // namespace

SimWorker::SimWorker(World& world, Network& network, Ledger& ledger, Config config)
    : world_(world), network_(network), ledger_(ledger), config_(std::move(config)) {
  network_.connect(config_.id, [this](const Delivery& d) { hear(d); });
}

void SimWorker::later(std::int64_t delay_ms, std::function<void()> fn) {
  world_.after(delay_ms, [this, incarnation = incarnation_, fn = std::move(fn)] {
    if (process_ && incarnation_ == incarnation) fn();
  });
}

void SimWorker::start() {
  if (process_ || is_lost_) return;
  ++incarnation_;
  AgentConfig config;
  config.worker_id = config_.id;
  config.incarnation = incarnation_;
  config.host = "host";
  config.slots = config.cores = config_.slots;
  config.ram_mb = 8000;
  process_ = std::make_unique<Process>(config, outbox_, config_.farm);
  stalled_until_ms_ = 0;
  death_.reset();
  world_.note("{} starts, incarnation {}, {} in its outbox", config_.id, incarnation_, outbox_.size());
  wake();
}

void SimWorker::kill(Death where, std::int64_t down_ms) {
  if (!process_) return;
  death_ = where;
  down_ms_ = down_ms;
  try {
    die_if(Death::AtOnce);
  } catch (const Died&) {
  }
}

void SimWorker::die_if(Death here) {
  if (death_ != here || world_.calm) return;
  world_.note("{} is killed with {} jobs (moment {})", config_.id, process_->children.size(), static_cast<int>(here));
  process_.reset();
  world_.after(down_ms_, [this] { start(); });
  throw Died{};
}

void SimWorker::stall(std::int64_t for_ms) {
  if (!process_) return;
  world_.note("{} is stopped for {} ms", config_.id, for_ms);
  stalled_until_ms_ = std::max(stalled_until_ms_, world_.now_ms() + for_ms);
}

void SimWorker::lose() {
  world_.note("{} is lost", config_.id);
  process_.reset();
  is_lost_ = true;
}

bool SimWorker::is_idle() const {
  return process_ && process_->children.empty() && process_->exits.empty() && !process_->agent.has_running() &&
         process_->agent.done_unacked().empty() && outbox_.empty();
}

std::string SimWorker::what_it_does() const {
  if (!process_) return config_.id + " is down";
  std::string text = fmt::format("{}: {} children, {} unacknowledged, {} in the outbox;", config_.id,
                                 process_->children.size(), process_->agent.done_unacked().size(), outbox_.size());
  for (const auto& [ref, child] : process_->children) text += fmt::format(" runs {} #{}", child.job.job, ref.number);
  return text;
}

void SimWorker::hear(const Delivery& delivery) {
  if (!process_) return;
  const auto message = process_->decoder.take(delivery.datagram);
  if (message && delivery.damaged) throw Violation("a worker understood a damaged datagram");
  if (!message) return;
  if (const auto* orders = std::get_if<WorkerOrders>(&*message)) {
    process_->inbox.push_back(*orders);
    later(std::max<std::int64_t>(0, stalled_until_ms_ - world_.now_ms()), [this] { turn(); });
  }
}

/// The loop's own time-out: every tick, over and over.
void SimWorker::wake() {
  turn();
  if (process_) later(kTickEveryMs, [this] { wake(); });
}

void SimWorker::turn() {
  if (world_.now_ms() < stalled_until_ms_) return;
  try {
    for (const WorkerOrders& orders : std::exchange(process_->inbox, {}))
      apply(process_->agent.on_orders(orders, world_.now_ms()));
    for (const ChildExit& exit : std::exchange(process_->exits, {})) {
      const auto before = process_->agent.done_unacked().size();
      apply(process_->agent.on_child_exit(exit, world_.now_ms()));
      if (process_->agent.done_unacked().size() > before)
        ledger_.ends[exit.ref].insert(process_->agent.done_unacked().back().outcome);
      report_when_due();
    }
    if (world_.now_ms() >= process_->next_tick_ms) {
      process_->next_tick_ms = world_.now_ms() + kTickEveryMs;
      for (const auto& [ref, child] : process_->children)
        apply(process_->agent.on_progress({ref, "working", 0.5, 100}, world_.now_ms(), world_.now_ms()));
      apply(process_->agent.on_tick(world_.now_ms(), kFreeRamMb));
    }
    report_when_due();
    save_outbox();
  } catch (const Died&) {
  }
}

void SimWorker::apply(const Actions& actions) {
  process_->changed |= actions.state_changed;
  process_->outbox_grew |= actions.outbox_grew;
  for (const SignalChild& s : actions.signals) signal_child(s);
  for (const Assignment& a : actions.start) start_child(a);
  if (!actions.start.empty()) die_if(Death::AfterStart);
}

void SimWorker::start_child(const Assignment& a) {
  const std::uint64_t serial = hash_of(config_.id) + ++num_children_;
  const Dice& dice = world_.dice;
  const auto chance = [&](double p, const char* what) { return !world_.calm && dice.chance(p, what, serial); };
  if (!ledger_.started.insert(a.ref).second)
    throw Violation(fmt::format("attempt {} of job {} was started twice", a.ref.number, a.ref.job_id));
  if (a.spec_path.empty()) return run_inside(a);
  Child child{.assignment = a,
              .job = read_job_file(a.spec_path),
              .serial = serial,
              .started_ms = world_.now_ms(),
              .content = ""};
  child.stubborn = dice.chance(0.2, "stubborn", serial);
  for (const auto& [name, input] : child.job.inputs) {
    const auto manifest = read_valid_manifest(input.folder);
    if (!manifest || manifest->content != input.content)
      throw Violation(fmt::format("{} was started, but its input {} is not in the store", child.job.job, name));
  }
  world_.note("{} runs {} #{}", config_.id, child.job.job, a.ref.number);
  process_->children[a.ref] = std::move(child);
  if (chance(config_.fates.hang, "hang")) return;
  const std::int64_t wall_ms = dice.chance(0.2, "long", serial) ? dice.between(500, 8'000, "wall", serial)
                                                                : dice.between(1, 500, "wall", serial);
  const std::int64_t exit_ms = wall_ms + dice.between(0, 200, "exit", serial);
  const AttemptRef ref = a.ref;
  if (chance(config_.fates.crash, "crash")) return later(wall_ms, [this, ref] { end_child(ref, SIGSEGV, {}); });
  if (chance(config_.fates.fail, "fail"))
    return later(wall_ms, [this, ref] { end_child(ref, 0, failed(ref, ErrorKind::Transient, "storage went away")); });
  later(wall_ms, [this, ref] {
    if (const auto found = process_->children.find(ref); found != process_->children.end()) make(found->second);
  });
  const bool dies = chance(config_.fates.dies_after_commit, "dies after");
  later(exit_ms, [this, ref, dies] {
    const auto found = process_->children.find(ref);
    if (found == process_->children.end()) return;
    if (dies) return end_child(ref, SIGSEGV, {});
    end_child(ref, 0, DoneAttempt{.ref = ref, .error_kind = "", .message = "", .content = found->second.content});
  });
}

/// A job without a process: done at once, and it leaves nothing.
void SimWorker::run_inside(const Assignment& a) {
  process_->children[a.ref].assignment = a;
  end_child(a.ref, 0,
            DoneAttempt{.ref = a.ref, .error_kind = "", .message = "", .content = std::string(kNothingPublished)});
}

/// The commit: a result that is there stays; else it is made, and seen at once or after a while.
void SimWorker::make(Child& child) {
  child.has_made_it = true;
  const auto folder = artifact_folder(child.job.store, child.job.kind, child.job.key);
  if (const auto manifest = read_valid_manifest(folder)) {
    child.content = manifest->content;
    return;
  }
  ++ledger_.num_made[child.job.key];
  world_.note("{} has made {} (attempt {})", config_.id, child.job.job, child.assignment.ref.number);
  const bool late = !world_.calm && world_.dice.chance(config_.fates.late_storage, "late", child.serial);
  if (!late) {
    child.content = make_artifact(child.job);
    return;
  }
  JobFile job = child.job;
  job.store = config_.elsewhere;
  child.content = make_artifact(job);
  world_.after(world_.dice.between(0, 4'000, "late by", child.serial), [folder, job = child.job] {
    if (!read_valid_manifest(folder)) make_artifact(job);
  });
}

void SimWorker::end_child(const AttemptRef& ref, int signal, std::optional<DoneAttempt> outcome) {
  if (process_->children.erase(ref) == 0) return;
  ChildExit exit;
  exit.ref = ref;
  exit.signal = signal;
  exit.wall_ms = 100;
  exit.has_outcome = outcome.has_value();
  if (outcome) exit.outcome = *outcome;
  process_->exits.push_back(exit);
  later(std::max<std::int64_t>(0, stalled_until_ms_ - world_.now_ms()), [this] { turn(); });
}

void SimWorker::signal_child(const SignalChild& s) {
  const auto found = process_->children.find(s.ref);
  if (found == process_->children.end() || (s.signal == SIGTERM && found->second.stubborn)) return;
  const bool is_too_slow = world_.now_ms() - found->second.started_ms >= found->second.assignment.timeout_s * 1000L;
  if (!is_too_slow) config_.on_stop(s.ref);
  world_.note("{} signals {} #{} ({})", config_.id, found->second.job.job, s.ref.number, s.signal);
  later(world_.dice.between(0, 30, "signal", found->second.serial), [this, s] { end_child(s.ref, s.signal, {}); });
}

void SimWorker::report_when_due() {
  Process& p = *process_;
  const std::int64_t every_ms = p.agent.has_seen_orders() ? kReportEveryMs : kReportUntilHeardMs;
  const std::int64_t due_ms = p.last_report_ms + (p.changed ? kMinReportPauseMs : every_ms);
  if (world_.now_ms() < due_ms) {
    if (p.changed) later(due_ms - world_.now_ms(), [this] { turn(); });
    return;
  }
  if (!p.agent.done_unacked().empty()) die_if(Death::BeforeReport);
  p.last_report_ms = world_.now_ms();
  p.changed = false;
  const Origin origin{.sender = config_.id, .incarnation = incarnation_, .seq = ++p.seq};
  for (const std::string& datagram :
       encode(p.agent.report({.now_ms = world_.now_ms(), .free_disk_mb = 50'000, .wall_ms = world_.now_ms()}), origin,
              config_.farm))
    network_.send(config_.id, "scheduler", datagram);
}

void SimWorker::save_outbox() {
  Process& p = *process_;
  if (!p.outbox_grew && p.agent.done_unacked().size() == outbox_.size()) return;
  die_if(Death::BeforeOutbox);
  outbox_ = p.agent.done_unacked();
  p.outbox_grew = false;
  die_if(Death::AfterOutbox);
}

std::uint64_t SimWorker::hash_of(const std::string& text) {
  std::uint64_t hash = 0;
  for (const char c : text) hash = hash * 131 + static_cast<unsigned char>(c);
  return hash << 20U;
}

}  // namespace vantage
