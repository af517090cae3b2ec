/// Workers on other hosts: multicast between network namespaces that lose, repeat, delay and change messages.
#include "tests/support/network.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "schema/messages/endpoint.h"
#include "tests/faults/farm_facts.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/udp_relay.h"

namespace vantage::faults {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr std::uint16_t kPort = 7667;
constexpr const char* kMulticast = "udpm://239.255.76.67:7667?ttl=1";
constexpr int kLease_ms = 3000;

class NetworkTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { why_not_ = Network::why_not(); }
  void SetUp() override {
    if (!why_not_.empty()) GTEST_SKIP() << "no network namespaces here: " << why_not_;
  }

  /// The scheduler on host 0, a worker on each other host.
  void start(Network& net, int num_hosts, const std::string& bus = kMulticast) {
    ShortFarm::Settings settings{.lease_ms = kLease_ms, .place = {.netns = net.host(0)}};
    if (bus.empty())
      settings.bus_listen = net.address(0);
    else
      settings.bus = bus;
    farm = std::make_unique<ShortFarm>(folder.path(), settings);
    farm->start();
    for (int host = 1; host < num_hosts; ++host)
      workers.push_back(std::make_unique<ShortWorker>(
          *farm, "worker" + std::to_string(host),
          ShortWorker::Settings{.slots = 2, .place = {.netns = net.host(host), .environment = {journal_variable()}}}));
  }
  std::string journal_variable() const { return "VANTAGE_SHORT_JOURNAL=" + journal().string(); }
  fs::path journal() const { return folder.path() / "journal"; }
  fs::path shot() const { return folder.path() / "shot"; }
  std::int64_t submit(const std::string& tables) {
    write_short_shot(shot(), tables);
    return farm->submit(shot());
  }
  /// What everybody's eyes see of the farm's truth, but for the passing of time.
  std::map<std::string, std::string> truth() const {
    std::map<std::string, std::string> truth;
    for (const JobFact& job : jobs_of(*farm)) truth[job.name] = job.state + " " + job.content;
    for (const AttemptFact& a : attempts_of(*farm))
      truth[a.job + "#" + std::to_string(a.number)] = a.worker_id + " " + a.state + " " + a.outcome;
    return truth;
  }

  TemporaryFolder folder;
  std::unique_ptr<ShortFarm> farm;
  std::vector<std::unique_ptr<ShortWorker>> workers;

 private:
  static inline std::string why_not_;
};

TEST_F(NetworkTest, MulticastOverASwitchThatLosesAThird) {
  Network net(3, Network::Middle::Bridge);
  for (int host = 0; host < 3; ++host) net.set_loss(host, 30);
  start(net, 3);
  EXPECT_TRUE(wait_until([&] { return farm->get("/workers").at("workers").size() == 2; }, 20));
  const auto id = submit("[seed]\nnum_jobs = 100\n[mix]\nnum_jobs = 50\n");
  EXPECT_EQ(wait_for_end(*farm, id, 60), "done");
  expect_all_done_once(*farm, shot(), journal());
}

TEST_F(NetworkTest, FiveThousandJobsInAStormAreAllDoneOnce) {
  constexpr int kNumHosts = 3;
  Network net(kNumHosts, Network::Middle::Nothing);
  UdpRelay relay(net, kNumHosts, {kPort, kPort + 1}, /*seed=*/2011);
  start(net, kNumHosts);
  ASSERT_TRUE(wait_until([&] { return farm->get("/workers").at("workers").size() == 2; }, 20));
  for (int host = 0; host < kNumHosts; ++host) net.set_loss(host, 30);
  relay.set_weather({.duplicate_percent = 10, .corrupt_percent = 1, .max_delay_ms = 60});
  const auto id = submit("[blip]\nnum_jobs = 4800\n[seed]\nnum_jobs = 150\n[mix]\nnum_jobs = 50\n");
  EXPECT_EQ(wait_for_end(*farm, id, 120), "done");
  EXPECT_EQ(jobs_of(*farm).size(), 5000U);
  expect_all_done_once(*farm, shot(), journal());
  const UdpRelay::Counts counts = relay.counts();
  std::printf("%ld datagrams: %ld came twice, %ld changed, %ld late, and a third of all lost; %zu attempts\n",
              static_cast<long>(counts.carried), static_cast<long>(counts.duplicated),
              static_cast<long>(counts.corrupted), static_cast<long>(counts.delayed), attempts_of(*farm).size());
  EXPECT_GT(counts.corrupted, 0);
}

TEST_F(NetworkTest, AHostThatIsCutOffAndJoinsAgainDoesNoHarm) {
  Network net(3, Network::Middle::Bridge);
  start(net, 3);
  const auto id = submit("[seed]\nnum_jobs = 200\npause_ms = 60\n[trouble]\nslow = 2\nslow_ms = 2000\n");
  ASSERT_TRUE(wait_until([&] { return num_jobs_in(*farm, "done") >= 20; }, 30));
  net.set_loss(1, 100);
  const auto is_lost = [&] { return farm->ask({"workers"}).find("lost") != std::string::npos; };
  EXPECT_TRUE(wait_until(is_lost, kLease_ms / 1000.0 + 10)) << "people see that it is lost";
  net.set_loss(1, 0);
  EXPECT_TRUE(wait_until([&] { return !is_lost(); }, 10)) << "people see that it is back";
  EXPECT_EQ(wait_for_end(*farm, id, 60), "done");
  expect_all_done_once(*farm, shot(), journal());
}

TEST_F(NetworkTest, WorkersFindTheBrokerAgainFromAnotherHost) {
  Network net(2, Network::Middle::Bridge);
  start(net, 2, /*bus=*/"");
  const auto id = submit("[seed]\nnum_jobs = 150\npause_ms = 40\n");
  ASSERT_TRUE(wait_until([&] { return num_jobs_in(*farm, "done") >= 20; }, 30));
  farm->kill();  // and the broker with it
  farm->start();
  EXPECT_EQ(wait_for_end(*farm, id, 60), "done");
  expect_all_done_once(*farm, shot(), journal());
}

/// What the scheduler counts as dropped, for a reason.
double dropped(ShortFarm& farm, const std::string& reason) {
  return farm.metric("vantage_messages_dropped_total{reason=\"" + reason + "\"}");
}

TEST_F(NetworkTest, UnsignedForeignAndRepeatedMessagesChangeNothingAndAreCounted) {
  Network net(3, Network::Middle::Nothing);
  UdpRelay relay(net, 3, {kPort, kPort + 1}, /*seed=*/7);
  relay.record();
  start(net, 2);  // host 2 is the stranger's
  const auto id = submit("[seed]\nnum_jobs = 30\n[trouble]\nbad = 1\n");
  EXPECT_EQ(wait_for_end(*farm, id, 30), "failed");
  const auto before = truth();
  const auto workers_before = farm->get("/workers").at("workers").size();

  // All that was ever said, once more: into the same life of scheduler and worker, and into the next.
  EXPECT_GT(relay.replay(), 30U);
  ASSERT_TRUE(wait_until([&] { return dropped(*farm, "older") > 20; }, 10));
  EXPECT_EQ(truth(), before);
  farm->kill();
  farm->start();
  workers[0]->kill();
  workers[0]->start();
  relay.replay();
  EXPECT_EQ(truth(), before);

  // One byte changed in every datagram.
  relay.set_weather({.corrupt_percent = 100});
  ASSERT_TRUE(wait_until([&] { return dropped(*farm, "bad_mac") > 3; }, 20));
  relay.set_weather({});

  // A worker of another farm on the same port.
  in_netns(net.host(2), [&] {
    const Farm foreign = read_or_create_farm_key(folder.path() / "foreign.key");
    LcmEndpoint stranger({.url = kMulticast, .farm = foreign, .sender = "stranger", .incarnation = 1});
    WorkerReport report;
    report.worker_id = "stranger";
    report.incarnation = 1;
    report.slots = 8;
    for (int i = 0; i < 20; ++i) {
      report.seq = i + 1;
      stranger.publish(report);
      usleep(10'000);
    }
  });
  ASSERT_TRUE(wait_until([&] { return dropped(*farm, "foreign") >= 10; }, 10));
  EXPECT_EQ(truth(), before);
  EXPECT_EQ(farm->get("/workers").at("workers").size(), workers_before) << "no stranger became a worker";
}

}  // namespace
}  // namespace vantage::faults
