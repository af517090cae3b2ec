#pragma once
#include <chrono>
#include <functional>
#include <thread>

#include "schema/messages/codec.h"

namespace vantage {

inline Farm test_farm() { return farm_of_key("a key that only tests know"); }

inline WorkerReport sample_report() {
  WorkerReport r;
  r.worker_id = "w-1";
  r.incarnation = 77;
  r.seq = 5;
  r.host = "left-desk";
  r.pool = "night";
  r.slots = 3;
  r.cores = 16;
  r.ram_mb = 64'000;
  r.free_disk_mb = 123'456;
  r.draining = true;
  r.epoch_seen = 9;
  r.orders_seq_seen = 1'000'000'000'000;
  r.running = {{{11, 2, -3}, "warping", 0.25, 812}, {{12, 1, 99}, "", 0, 0}};
  r.done_unacked = {
      {{7, 1, 1LL << 62}, Outcome::Crashed, "crash", "killed by signal 11", "", -1, 11, 61'000, 4096, "sync/a__b"}};
  r.tags = {"gpu", "fast-disk"};
  r.kinds = {"depth/1", "noop/1"};
  r.wall_ms = 1'700'000'000'123;
  r.build = "0.1.0";
  r.trouble = "disk full: /store has 12 MB";
  r.num_dropped = 17;
  return r;
}

inline WorkerOrders sample_orders() {
  WorkerOrders o;
  o.worker_id = "w-1";
  o.incarnation = 77;
  o.epoch = 9;
  o.seq = 41;
  o.lease_ms = 15'000;
  o.reconciling = true;
  o.drain = true;
  o.assigned = {{{11, 2, -3},
                 "/shot/.vantage/specs/11.2.json",
                 "00ff",
                 "/shot/.vantage/logs/11.2.log",
                 4,
                 3000,
                 600,
                 "depth/1",
                 R"({"unit":{"image":3}})"}};
  o.canceled = {{8, 1, 2}};
  o.acked = {{7, 1, 1LL << 62}, {6, 3, 4}};
  o.report_seq_seen = 123;
  o.host = "left-desk";
  return o;
}

/// For what another thread or the kernel does: true as soon as `condition` holds, false after 10 s.
inline bool eventually(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace vantage
