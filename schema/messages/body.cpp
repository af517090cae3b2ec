#include "schema/messages/body.h"

#include <array>
#include <stdexcept>
#include <vantage_lcm/scheduler_hello_t.hpp>
#include <vantage_lcm/worker_orders_t.hpp>
#include <vantage_lcm/worker_report_t.hpp>

#include "schema/base/error.h"

namespace vantage {
namespace {
namespace wire = vantage_lcm;

// Smallest encoded sizes: numbers as they are, a string takes at least its length and a NUL.
constexpr std::size_t kRefBytes = 20;
constexpr std::size_t kRunningBytes = kRefBytes + 5 + 8 + 4;
constexpr std::size_t kDoneBytes = kRefBytes + 1 + 3 * 5 + 4 + 4 + 8 + 4 + 5;
constexpr std::size_t kAssignmentBytes = kRefBytes + 5 * 5 + 3 * 4;
constexpr std::size_t kStringBytes = 5;

wire::attempt_ref_t to_wire(const AttemptRef& r) {
  wire::attempt_ref_t w;
  w.job_id = r.job_id;
  w.number = r.number;
  w.token = r.token;
  return w;
}
AttemptRef from_wire(const wire::attempt_ref_t& w) { return {w.job_id, w.number, w.token}; }

wire::running_attempt_t to_wire(const RunningAttempt& r) {
  wire::running_attempt_t w;
  w.ref = to_wire(r.ref);
  w.phase = r.phase;
  w.progress = r.progress;
  w.rss_mb = r.rss_mb;
  return w;
}
RunningAttempt from_wire(const wire::running_attempt_t& w) { return {from_wire(w.ref), w.phase, w.progress, w.rss_mb}; }

wire::done_attempt_t to_wire(const DoneAttempt& d) {
  wire::done_attempt_t w;
  w.ref = to_wire(d.ref);
  w.outcome = static_cast<std::int8_t>(d.outcome);
  w.error_kind = d.error_kind;
  w.message = d.message;
  w.content = d.content;
  w.exit_code = d.exit_code;
  w.signal = d.signal;
  w.wall_ms = d.wall_ms;
  w.peak_rss_mb = d.peak_rss_mb;
  w.damaged_job = d.damaged_job;
  return w;
}
DoneAttempt from_wire(const wire::done_attempt_t& w) {
  if (w.outcome < 0 || w.outcome > static_cast<std::int8_t>(Outcome::Canceled)) throw std::out_of_range("outcome");
  return {from_wire(w.ref), static_cast<Outcome>(w.outcome),
          w.error_kind,     w.message,
          w.content,        w.exit_code,
          w.signal,         w.wall_ms,
          w.peak_rss_mb,    w.damaged_job};
}

wire::assignment_t to_wire(const Assignment& a) {
  wire::assignment_t w;
  w.ref = to_wire(a.ref);
  w.spec_path = a.spec_path;
  w.spec_hash = a.spec_hash;
  w.log_path = a.log_path;
  w.cores = a.cores;
  w.ram_mb = a.ram_mb;
  w.timeout_s = a.timeout_s;
  w.kind = a.kind;
  w.spec = a.spec;
  return w;
}
Assignment from_wire(const wire::assignment_t& w) {
  return {from_wire(w.ref), w.spec_path, w.spec_hash, w.log_path, w.cores, w.ram_mb, w.timeout_s, w.kind, w.spec};
}

/// Element by element, with the count that LCM wants beside the array.
template <class From, class To>
std::int32_t to_wire_array(const std::vector<From>& from, std::vector<To>& to) {
  for (const From& item : from) to.push_back(to_wire(item));
  return static_cast<std::int32_t>(to.size());
}
template <class From, class To>
void from_wire_array(const std::vector<From>& from, std::vector<To>& to) {
  for (const From& item : from) to.push_back(from_wire(item));
}

wire::worker_report_t to_wire(const WorkerReport& r) {
  wire::worker_report_t w;
  w.num_running = to_wire_array(r.running, w.running);
  w.num_done = to_wire_array(r.done_unacked, w.done_unacked);
  w.worker_id = r.worker_id;
  w.incarnation = r.incarnation;
  w.seq = r.seq;
  w.host = r.host;
  w.pool = r.pool;
  w.slots = r.slots;
  w.cores = r.cores;
  w.ram_mb = r.ram_mb;
  w.free_disk_mb = r.free_disk_mb;
  w.draining = static_cast<std::int8_t>(r.draining);
  w.epoch_seen = r.epoch_seen;
  w.orders_seq_seen = r.orders_seq_seen;
  w.num_tags = static_cast<std::int32_t>(r.tags.size());
  w.tags = r.tags;
  w.num_kinds = static_cast<std::int32_t>(r.kinds.size());
  w.kinds = r.kinds;
  w.wall_ms = r.wall_ms;
  w.build = r.build;
  w.trouble = r.trouble;
  w.num_dropped = r.num_dropped;
  return w;
}
WorkerReport from_wire(const wire::worker_report_t& w) {
  WorkerReport r;
  r.worker_id = w.worker_id;
  r.incarnation = w.incarnation;
  r.seq = w.seq;
  r.host = w.host;
  r.pool = w.pool;
  r.slots = w.slots;
  r.cores = w.cores;
  r.ram_mb = w.ram_mb;
  r.free_disk_mb = w.free_disk_mb;
  r.draining = w.draining != 0;
  r.epoch_seen = w.epoch_seen;
  r.orders_seq_seen = w.orders_seq_seen;
  from_wire_array(w.running, r.running);
  from_wire_array(w.done_unacked, r.done_unacked);
  r.tags = w.tags;
  r.kinds = w.kinds;
  r.wall_ms = w.wall_ms;
  r.build = w.build;
  r.trouble = w.trouble;
  r.num_dropped = w.num_dropped;
  return r;
}

wire::worker_orders_t to_wire(const WorkerOrders& o) {
  wire::worker_orders_t w;
  w.num_assigned = to_wire_array(o.assigned, w.assigned);
  w.num_canceled = to_wire_array(o.canceled, w.canceled);
  w.num_acked = to_wire_array(o.acked, w.acked);
  w.worker_id = o.worker_id;
  w.incarnation = o.incarnation;
  w.epoch = o.epoch;
  w.seq = o.seq;
  w.lease_ms = o.lease_ms;
  w.reconciling = static_cast<std::int8_t>(o.reconciling);
  w.drain = static_cast<std::int8_t>(o.drain);
  w.report_seq_seen = o.report_seq_seen;
  w.host = o.host;
  return w;
}
WorkerOrders from_wire(const wire::worker_orders_t& w) {
  WorkerOrders o;
  o.worker_id = w.worker_id;
  o.incarnation = w.incarnation;
  o.epoch = w.epoch;
  o.seq = w.seq;
  o.lease_ms = w.lease_ms;
  o.reconciling = w.reconciling != 0;
  o.drain = w.drain != 0;
  from_wire_array(w.assigned, o.assigned);
  from_wire_array(w.canceled, o.canceled);
  from_wire_array(w.acked, o.acked);
  o.report_seq_seen = w.report_seq_seen;
  o.host = w.host;
  return o;
}

wire::scheduler_hello_t to_wire(const SchedulerHello& h) {
  wire::scheduler_hello_t w;
  w.farm_id = h.farm_id;
  w.epoch = h.epoch;
  w.http_address = h.http_address;
  w.reconciling = static_cast<std::int8_t>(h.reconciling);
  return w;
}
SchedulerHello from_wire(const wire::scheduler_hello_t& w) {
  return {w.farm_id, w.epoch, w.http_address, w.reconciling != 0};
}

/// Least bytes per array item, in the order of the counts that open a body of this kind (Message::index()).
std::vector<std::size_t> item_bytes(int kind) {
  switch (kind) {
    case 0:
      return {kRunningBytes, kDoneBytes, kStringBytes, kStringBytes};
    case 1:
      return {kAssignmentBytes, kRefBytes, kRefBytes};
    default:
      return {};
  }
}

bool counts_fit(int kind, std::string_view bytes) {
  constexpr std::size_t kFingerprintBytes = 8;
  std::size_t at = kFingerprintBytes;
  std::size_t least_bytes = kFingerprintBytes;
  for (const std::size_t item : item_bytes(kind)) {
    if (bytes.size() < at + 4) return false;
    std::uint32_t count = 0;
    for (std::size_t i = 0; i < 4; ++i) count = count << 8U | static_cast<unsigned char>(bytes[at + i]);
    if (count > bytes.size()) return false;
    least_bytes += 4 + item * count;
    at += 4;
  }
  return least_bytes <= bytes.size();
}

template <class Wire>
std::optional<Message> decode_as(std::string_view bytes) {
  Wire w;
  const int used = w.decode(bytes.data(), 0, static_cast<int>(bytes.size()));
  if (used != static_cast<int>(bytes.size())) return std::nullopt;
  return from_wire(w);
}

}  // namespace

std::string encode_body(const Message& message) {
  return std::visit(
      [](const auto& value) {
        const auto w = to_wire(value);
        std::string bytes(static_cast<std::size_t>(w.getEncodedSize()), '\0');
        const int used = w.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
        check(used >= 0, "a message fits into the size that it says");
        bytes.resize(static_cast<std::size_t>(used));
        return bytes;
      },
      message);
}

std::optional<Message> decode_body(int kind, std::string_view bytes) {
  if (!counts_fit(kind, bytes)) return std::nullopt;
  try {
    switch (kind) {
      case 0:
        return decode_as<wire::worker_report_t>(bytes);
      case 1:
        return decode_as<wire::worker_orders_t>(bytes);
      case 2:
        return decode_as<wire::scheduler_hello_t>(bytes);
      default:
        return std::nullopt;
    }
  } catch (const std::exception&) {
    return std::nullopt;  // LCM's generated code throws on some bad lengths: the caller counts it as malformed
  }
}

}  // namespace vantage
