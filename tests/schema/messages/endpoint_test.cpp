#include "schema/messages/endpoint.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include "schema/base/error.h"
#include "schema/messages/broker.h"
#include "schema/messages/transport.h"
#include "tests/schema/messages/messages_support.h"

namespace vantage {
namespace {

using namespace std::chrono_literals;

std::unique_ptr<LcmEndpoint> scheduler_at(const std::string& url, std::int64_t epoch = 1) {
  return std::make_unique<LcmEndpoint>(LcmEndpoint::Config{.url = url,
                                                           .farm = test_farm(),
                                                           .role = LcmEndpoint::Role::Scheduler,
                                                           .sender = std::string(kSchedulerSender),
                                                           .incarnation = epoch});
}
std::unique_ptr<LcmEndpoint> worker_at(const std::string& url, const std::string& id = "w-1",
                                       const Farm& farm = test_farm()) {
  return std::make_unique<LcmEndpoint>(
      LcmEndpoint::Config{.url = url, .farm = farm, .role = LcmEndpoint::Role::Worker, .sender = id, .incarnation = 1});
}

/// Subscriptions are on their way after connecting: hellos go out until the worker hears one.
void connect_to_worker(LcmEndpoint& scheduler, LcmEndpoint& worker) {
  ASSERT_TRUE(eventually([&] {
    scheduler.publish(SchedulerHello{});
    return !worker.wait(5ms).empty();
  }));
}
void connect_to_scheduler(LcmEndpoint& worker, LcmEndpoint& scheduler) {
  ASSERT_TRUE(eventually([&] {
    worker.publish(WorkerReport{});
    return !scheduler.wait(5ms).empty();
  }));
  while (!scheduler.wait(20ms).empty()) {
  }
}

TEST(Endpoint, TenThousandReportsPassTheBrokerInOrder) {
  Broker broker({});
  const auto scheduler = scheduler_at(broker.url());
  const auto worker = worker_at(broker.url());
  connect_to_scheduler(*worker, *scheduler);
  constexpr int kNumReports = 10'000;
  WorkerReport report = sample_report();
  for (report.seq = 1; report.seq <= kNumReports; ++report.seq) worker->publish(report);
  std::int64_t last_seq = 0;
  ASSERT_TRUE(eventually([&] {
    for (const Message& m : scheduler->wait(100ms)) {
      EXPECT_EQ(std::get<WorkerReport>(m).seq, last_seq + 1);
      last_seq = std::get<WorkerReport>(m).seq;
    }
    return last_seq == kNumReports;
  }));
  EXPECT_EQ(scheduler->drops().total(), 0);
  EXPECT_EQ(broker.counts().num_dropped, 0);
}

TEST(Endpoint, OrdersReachOnlyTheirWorker) {
  Broker broker({});
  const auto scheduler = scheduler_at(broker.url());
  const auto one = worker_at(broker.url(), "w-1");
  const auto two = worker_at(broker.url(), "w-2");
  connect_to_worker(*scheduler, *one);
  connect_to_worker(*scheduler, *two);
  for (auto* worker : {one.get(), two.get()})
    while (!worker->wait(20ms).empty()) {
    }
  WorkerOrders orders = sample_orders();
  orders.worker_id = "w-2";
  scheduler->publish(orders);
  const auto got = two->wait(5s);
  ASSERT_FALSE(got.empty());
  EXPECT_EQ(std::get<WorkerOrders>(got.back()).worker_id, "w-2");
  EXPECT_TRUE(one->wait(50ms).empty());
}

TEST(Endpoint, RoundTripThroughTheBrokerTakesNoNagleDelay) {
  Broker broker({});
  const auto scheduler = scheduler_at(broker.url());
  const auto worker = worker_at(broker.url());
  connect_to_scheduler(*worker, *scheduler);
  connect_to_worker(*scheduler, *worker);
  while (!worker->wait(20ms).empty()) {
  }
  std::vector<double> round_trips_ms;
  for (int i = 0; i < 50; ++i) {
    const auto start = std::chrono::steady_clock::now();
    worker->publish(sample_report());
    ASSERT_FALSE(scheduler->wait(2s).empty());
    scheduler->publish(sample_orders());
    ASSERT_FALSE(worker->wait(2s).empty());
    round_trips_ms.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(round_trips_ms.begin(), round_trips_ms.end());
  RecordProperty("median_round_trip_ms", std::to_string(round_trips_ms[25]));
  EXPECT_LT(round_trips_ms[25], 20) << "40 ms and more is Nagle's algorithm against delayed acknowledgements";
}

TEST(Endpoint, ConnectsAgainAfterTheBrokerWasAway) {
  auto broker = std::make_unique<Broker>(Broker::Config{});
  const std::uint16_t port = broker->port();
  const auto scheduler = scheduler_at(broker->url());
  const auto worker = worker_at(broker->url());
  connect_to_scheduler(*worker, *scheduler);
  broker.reset();
  ASSERT_TRUE(eventually([&] { return !worker->connected() && !scheduler->connected(); }));
  worker->publish(sample_report());
  broker = std::make_unique<Broker>(Broker::Config{.port = port});
  connect_to_scheduler(*worker, *scheduler);
}

TEST(Endpoint, StartsBeforeItsBroker) {
  const std::uint16_t port = Broker({}).port();
  const std::string url = "tcpq://127.0.0.1:" + std::to_string(port);
  const auto worker = worker_at(url);
  EXPECT_FALSE(worker->connected());
  const Broker broker({.port = port});
  EXPECT_TRUE(eventually([&] { return worker->connected(); }));
}

TEST(Endpoint, MessagesOfAnotherFarmAreCounted) {
  Broker broker({});
  const auto scheduler = scheduler_at(broker.url());
  const auto stranger = worker_at(broker.url(), "w-1", farm_of_key("the key of the farm next door"));
  EXPECT_TRUE(eventually([&] {
    stranger->publish(sample_report());
    return scheduler->drops().foreign > 0;
  }));
  EXPECT_TRUE(scheduler->take().empty());
}

TEST(Endpoint, PublishingFromSeveralThreadsLosesNothing) {
  Broker broker({});
  const auto scheduler = scheduler_at(broker.url());
  const auto worker = worker_at(broker.url());
  connect_to_scheduler(*worker, *scheduler);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 500; ++i) worker->publish(sample_report());
    });
  for (auto& t : threads) t.join();
  std::size_t num_received = 0;
  EXPECT_TRUE(eventually([&] { return (num_received += scheduler->wait(50ms).size()) >= 2000; }));
  EXPECT_EQ(scheduler->drops().total(), 0);
}

TEST(Endpoint, InMemoryTransportHearsItself) {
  const auto endpoint = scheduler_at("memq://");
  endpoint->publish(sample_report());
  const auto got = endpoint->wait(5s);
  ASSERT_EQ(got.size(), 1U);
  EXPECT_EQ(std::get<WorkerReport>(got[0]).worker_id, "w-1");
}

TEST(Endpoint, WakeDescriptorIsReadableWhileMessagesWait) {
  const auto endpoint = scheduler_at("memq://");
  pollfd p{.fd = endpoint->wake_fd(), .events = POLLIN, .revents = 0};
  EXPECT_EQ(poll(&p, 1, 0), 0);
  endpoint->publish(sample_report());
  EXPECT_EQ(poll(&p, 1, 5000), 1);
  EXPECT_EQ(endpoint->take().size(), 1U);
  EXPECT_EQ(poll(&p, 1, 0), 0);
}

TEST(Endpoint, MulticastCarriesStatesBothWays) {
  const std::string url = "udpm://239.255.76.67:" + std::to_string(20'000 + 2 * (getpid() % 20'000)) + "?ttl=0";
  std::unique_ptr<LcmEndpoint> scheduler, worker;
  try {
    scheduler = scheduler_at(url);
    worker = worker_at(url);
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("ip route add"), std::string::npos) << "says how to mend it";
    GTEST_SKIP() << e.what();
  }
  connect_to_scheduler(*worker, *scheduler);
  connect_to_worker(*scheduler, *worker);
  WorkerOrders large = sample_orders();
  for (int i = 0; i < 3000; ++i) large.assigned.push_back({{i, 1, i}, std::string(60, 's'), "h", "l", 1, 1, 1});
  EXPECT_TRUE(eventually([&] {
    scheduler->publish(large);
    for (const Message& m : worker->wait(100ms))
      if (const auto* orders = std::get_if<WorkerOrders>(&m)) return orders->assigned.size() == large.assigned.size();
    return false;
  })) << "pages arrive and are put together";
}

TEST(LcmUrl, BadOnesAreBadInput) {
  for (const char* bad : {"", "tcpq", "tcpq://", "tcpq://host", "tcpq://:77", "tcpq://host:0", "tcpq://host:x",
                          "http://host:80", "udpm://224.1.1.1"}) {
    try {
      parse_lcm_url(bad);
      ADD_FAILURE() << "accepted '" << bad << "'";
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::BadInput);
    }
  }
  const LcmUrl url = parse_lcm_url("udpm://239.255.76.67:7667?ttl=1");
  EXPECT_EQ(url.host, "239.255.76.67");
  EXPECT_EQ(url.port, 7667);
  EXPECT_EQ(url.options, "ttl=1");
  EXPECT_EQ(url.text(), "udpm://239.255.76.67:7667?ttl=1");
}

TEST(LcmUrl, AddressThatIsNoMulticastIsRefusedWithTheReason) {
  try {
    worker_at("udpm://127.0.0.1:7667");
    FAIL() << "accepted";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::BadInput);
    EXPECT_NE(std::string(e.what()).find("not a multicast address"), std::string::npos);
  }
}

}  // namespace
}  // namespace vantage
