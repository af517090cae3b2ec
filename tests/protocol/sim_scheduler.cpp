#include <algorithm>

#include "schema/base/error.h"
#include "tests/protocol/simulation.h"

namespace vantage {
namespace {

constexpr std::int64_t kTickMs = 250, kCoalesceMs = 2;

/// Jobs inside the workers, that publish nothing; all but the first one wait for footage.
KindEntry noop_kind(int num) {
  const auto split = [num](const ShotState&) {
    std::vector<WorkUnit> units(static_cast<std::size_t>(num));
    for (std::size_t i = 0; i < units.size(); ++i) {
      units[i].name = fmt::format("noop/{}", i);
      units[i].unit = {{"index", i}};
      if (i > 0) units[i].needs = {"ingest/a"};
      units[i].need = {.cores = 1, .ram_mb = 10, .timeout_s = 60};
    }
    return units;
  };
  return {.spec = {.name = "noop", .version = 1, .reads = "", .publishes = "", .in_worker = true},
          .split = split,
          .check = [](const Shot&) {},
          .params = [] { return std::vector<ParamDoc>{}; }};
}

}  // namespace

SimScheduler::SimScheduler(World& world, Network& network, Ledger& ledger, const Schedule& schedule, const Farm& farm)
    : world_(world), network_(network), identity_(farm), num_workers_(schedule.num_workers) {
  network_.connect("scheduler", [this](const Delivery& d) { hear(d); });
  farm_.kill();
  farm_.lease_ms = schedule.lease_ms;
  farm_.num_edges = schedule.num_edges;
  farm_.kinds.push_back(noop_kind(schedule.num_noops));
  farm_.out = this;
  farm_.before_commit = [this] { die_if(Death::BeforeCommit); };
  checks_.emplace(farm_.database(), farm_.shot_folder() / ".vantage" / "store", ledger);
  resubmit_ = true;
  start();
}

void SimScheduler::start() {
  if (is_up()) return;
  ++life_;
  seq_ = 0;
  decoder_.emplace(identity_);
  reports_.clear();
  death_.reset();
  turn_is_due_ = false;
  stalled_until_ms_ = 0;
  farm_.clock.now_ms = world_.now_ms() + 1;
  farm_.start();
  world_.note("scheduler starts, epoch {}", farm_.dispatcher->epoch());
  if (farm_.dispatcher->epoch() <= last_epoch_) throw Violation("the epoch did not rise with a start");
  last_epoch_ = farm_.dispatcher->epoch();
  wake();
}

void SimScheduler::kill(Death where, std::int64_t down_ms) {
  if (!is_up()) return;
  death_ = where;
  down_ms_ = down_ms;
  if (where != Death::AtOnce) return;
  try {
    die_if(Death::AtOnce);
  } catch (const Died&) {
  }
}

void SimScheduler::die_if(Death here) {
  if (death_ != here || world_.calm) return;
  world_.note("scheduler is killed (moment {})", static_cast<int>(here));
  throw Died{};
}

void SimScheduler::command(const Command& command) { commands_.push_back(command); }
void SimScheduler::resubmit() { resubmit_ = true; }

void SimScheduler::hear(const Delivery& delivery) {
  if (!is_up()) return;
  const auto message = decoder_->take(delivery.datagram);
  if (message && delivery.damaged) throw Violation("the scheduler understood a damaged datagram");
  if (!message) ++num_dropped_;
  const auto* report = message ? std::get_if<WorkerReport>(&*message) : nullptr;
  if (report == nullptr) return;
  reports_.push_back(*report);
  if (std::exchange(turn_is_due_, true)) return;
  world_.after(std::max(kCoalesceMs, stalled_until_ms_ - world_.now_ms()), [this, life = life_] {
    if (is_up() && life == life_) turn();
  });
}

void SimScheduler::wake() {
  if (world_.now_ms() >= stalled_until_ms_) turn();
  if (!is_up()) return;
  world_.after(kTickMs, [this, life = life_] {
    if (is_up() && life == life_) wake();
  });
}

/// One turn of the scheduler's thread, as scheduler/farm does it; it may be the last one.
void SimScheduler::turn() {
  turn_is_due_ = false;
  farm_.clock.now_ms = world_.now_ms() + 1;
  num_sent_in_turn_ = 0;
  try {
    farm_.turn([&] {
      if (std::exchange(resubmit_, false))
        farm_.store->guarded([&] { farm_.shot = farm_.planner->submit(farm_.shot_folder(), "", 0).shot.id; });
      for (const Command& c : std::exchange(commands_, {})) {
        try {
          farm_.store->guarded([&] { world_.note("{}", farm_.dispatcher->on_command(c).text); });
        } catch (const Error& e) {
          if (e.kind() != ErrorKind::BadInput) throw;
        }
      }
      for (const WorkerReport& r : std::exchange(reports_, {})) farm_.dispatcher->on_report(r, farm_.clock.now_ms);
      die_if(Death::InTransaction);
    });
    checks_->after_commit();
    checks_->after_flush();
    farm_.planner->take_effects();
    die_if(Death::BeforeSending);  // the next turn's chance, if this one sent nothing
  } catch (const Died&) {
    ++num_killed_;
    farm_.kill();
    checks_->scheduler_died();
    checks_->after_commit();
    world_.after(down_ms_, [this] { start(); });
  }
}

void SimScheduler::send(const WorkerOrders& orders) {
  die_if(Death::BeforeSending);
  checks_->on_orders(orders);
  say(orders, orders.worker_id);
  if (++num_sent_in_turn_ > 1) die_if(Death::WhileSending);
}

void SimScheduler::send(const SchedulerHello& hello) {
  for (int w = 0; w < num_workers_; ++w) say(hello, fmt::format("w{}", w));
}

void SimScheduler::say(const Message& message, const std::string& to) {
  const Origin origin{.sender = std::string(kSchedulerSender), .incarnation = farm_.dispatcher->epoch(), .seq = ++seq_};
  for (const std::string& datagram : encode(message, origin, identity_)) network_.send("scheduler", to, datagram);
}

}  // namespace vantage
