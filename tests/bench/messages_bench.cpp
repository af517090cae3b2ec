/// What a message costs: the codec with its signature, and the way through our broker and back.
///
///   messages_bench [ROUNDS]     prints one JSON line; the report is that of a worker with 2 slots, 64 jobs ahead
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "schema/base/json.h"
#include "schema/messages/broker.h"
#include "schema/messages/endpoint.h"

namespace vantage {
namespace {

double now_us() {
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

WorkerReport typical_report() {
  WorkerReport report;
  report.worker_id = "0f1e2d3c-4b5a-6978-8796-a5b4c3d2e1f0";
  report.incarnation = 1;
  report.host = "render-node-17";
  report.slots = report.cores = 2;
  for (int i = 0; i < 66; ++i)
    report.running.push_back({{i, 1, 1'000'000 + i}, i < 2 ? "matching" : "queued", 0.5, 900});
  return report;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + std::ssize(values) / 2, values.end());
  return values[values.size() / 2];
}

Json measure_codec(const Farm& farm, int num_rounds) {
  const WorkerReport report = typical_report();
  Decoder decoder(farm);
  std::size_t num_bytes = 0;
  std::vector<double> encode_us, decode_us;
  for (int i = 1; i <= num_rounds; ++i) {
    const double start = now_us();
    const auto datagrams = encode(report, {report.worker_id, 1, i}, farm);
    const double encoded = now_us();
    const bool is_there = decoder.take(datagrams.front()).has_value();
    decode_us.push_back(now_us() - encoded);
    encode_us.push_back(encoded - start);
    if (!is_there) throw std::runtime_error("a good datagram was dropped");
    num_bytes = datagrams.front().size();
  }
  return {{"report_bytes", num_bytes}, {"encode_us", median(encode_us)}, {"decode_us", median(decode_us)}};
}

/// Report up, orders down: the least time between a job's end and the next one's start.
Json measure_round_trip(const Farm& farm, int num_rounds) {
  Broker broker(Broker::Config{.host = "127.0.0.1", .port = 0});
  LcmEndpoint above({.url = broker.url(),
                     .farm = farm,
                     .role = LcmEndpoint::Role::Scheduler,
                     .sender = std::string(kSchedulerSender),
                     .incarnation = 1});
  WorkerReport report = typical_report();
  LcmEndpoint below({.url = broker.url(),
                     .farm = farm,
                     .role = LcmEndpoint::Role::Worker,
                     .sender = report.worker_id,
                     .incarnation = 1});
  WorkerOrders orders;
  orders.worker_id = report.worker_id;
  orders.incarnation = orders.epoch = orders.seq = 1;
  const std::chrono::milliseconds patience(200);
  std::vector<double> trip_us;
  for (int tries = 0; std::ssize(trip_us) < num_rounds && tries < num_rounds + 100; ++tries) {
    const double start = now_us();
    below.publish(report);
    if (above.wait(patience).empty()) continue;  // not connected yet
    above.publish(orders);
    if (!below.wait(patience).empty()) trip_us.push_back(now_us() - start);
  }
  if (std::ssize(trip_us) < num_rounds) throw std::runtime_error("messages through the broker were lost");
  std::sort(trip_us.begin(), trip_us.end());
  return {{"broker_round_trip_p50_us", trip_us[trip_us.size() / 2]},
          {"broker_round_trip_p99_us", trip_us[trip_us.size() * 99 / 100]}};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  using namespace vantage;
  const int num_rounds = argc > 1 ? std::stoi(argv[1]) : 10'000;
  try {
    const Farm farm = farm_of_key("the key of a farm that is measured");
    Json out{{"bench", "messages"}, {"rounds", num_rounds}};
    out.update(measure_codec(farm, num_rounds));
    out.update(measure_round_trip(farm, num_rounds));
    fmt::print("{}\n", out.dump());
    return 0;
  } catch (const std::exception& e) {
    fmt::print(stderr, "messages_bench: {}\n", e.what());
    return 1;
  }
}
