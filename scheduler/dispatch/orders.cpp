/// Dispatcher: what goes out after the commit.
#include <algorithm>
#include <utility>

#include "scheduler/dispatch/dispatcher.h"

namespace vantage {
namespace {

constexpr std::int64_t kHelloMs = 1'000, kFirstRepeatMs = 50, kSteadyMs = 1'000;

}  // namespace

void Dispatcher::flush(Bus& bus, const std::string& http_address, std::int64_t now_ms) {
  stop_revoked();
  if (now_ms >= next_hello_ms_) {
    bus.send(SchedulerHello{.farm_id = options_.farm_id,
                            .epoch = epoch_,
                            .http_address = http_address,
                            .reconciling = now_ms < reconcile_until_ms_});
    next_hello_ms_ = now_ms + kHelloMs;
  }
  for (const auto& [id, report] : std::exchange(to_greet_, {})) {
    WorkerOrders greeting = orders_for(report, now_ms);
    greeting.reconciling = true;  // we do not know yet what it has
    bus.send(greeting);
  }
  for (auto& [id, worker] : workers_)
    if (worker.seen_ms > 0 && !worker.lost && (worker.changed || now_ms >= worker.next_send_ms))
      send_orders(worker, bus, now_ms);
}

WorkerOrders Dispatcher::orders_for(const WorkerReport& report, std::int64_t now_ms) {
  return {.worker_id = report.worker_id,
          .incarnation = report.incarnation,
          .epoch = epoch_,
          .seq = ++last_seq_,
          .lease_ms = options_.lease_ms,
          .reconciling = now_ms < reconcile_until_ms_,
          .assigned = {},
          .canceled = {},
          .acked = {},
          .report_seq_seen = report.seq,
          .host = report.host};
}

/// Once on change, then after 50, 100, 200, … ms until the worker confirms, then every second.
void Dispatcher::send_orders(LiveWorker& worker, Bus& bus, std::int64_t now_ms) {
  WorkerOrders orders = orders_for(worker.report, now_ms);
  worker.seq = orders.seq;
  if (worker.changed) worker.changed_seq = worker.seq, worker.num_repeats = 0;
  worker.changed = false;
  const bool confirmed = worker.report.epoch_seen == epoch_ && worker.report.orders_seq_seen >= worker.changed_seq;
  const std::int64_t pause_ms =
      confirmed ? kSteadyMs : std::min(kSteadyMs, kFirstRepeatMs << std::min(worker.num_repeats, 5));
  ++worker.num_repeats;
  worker.next_send_ms = now_ms + pause_ms;

  orders.drain = worker.drained;
  orders.canceled.assign(worker.canceled.begin(), worker.canceled.end());
  orders.acked.assign(worker.acked.begin(), worker.acked.end());
  orders.assigned.reserve(worker.held.size());
  for (auto& [ref, held] : worker.held) {
    if (held.assigned_seq == 0) held.assigned_seq = worker.seq;
    orders.assigned.push_back(held.assignment);
  }
  bus.send(orders);
}

}  // namespace vantage
