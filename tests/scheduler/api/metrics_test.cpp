#include <gtest/gtest.h>

#include <charconv>
#include <map>
#include <regex>
#include <set>

#include "scheduler/api/metrics_text.h"
#include "tests/scheduler/api/api_server.h"

namespace vantage {
namespace {

struct Sample {
  std::string family, name, labels;
  double value = 0;
};

/// Reads the whole text by the rules of format 0.0.4; each breach is a failure.
std::vector<Sample> parse_metrics(const std::string& text) {
  static const std::regex help("# HELP ([a-z_]+) .*\\."), type("# TYPE ([a-z_]+) (counter|gauge|histogram)");
  static const std::regex line(R"re(([a-z_]+)(\{[a-z]+="[^"\\]*"(,[a-z]+="[^"\\]*")*\})? ([0-9.e+-]+))re");
  std::vector<Sample> samples;
  std::set<std::string> families, seen;
  std::string family, kind;
  std::smatch m;
  EXPECT_TRUE(text.ends_with('\n'));
  for (std::size_t start = 0; start < text.size();) {
    const auto end = text.find('\n', start);
    const std::string row = text.substr(start, end - start);
    start = end + 1;
    if (std::regex_match(row, m, help)) {
      EXPECT_TRUE(families.insert(m[1]).second) << "twice: " << row;
      family = m[1];
    } else if (std::regex_match(row, m, type)) {
      EXPECT_EQ(m[1], family) << row;
      kind = m[2];
      EXPECT_EQ(kind == "counter", family.ends_with("_total")) << row;
    } else if (std::regex_match(row, m, line)) {
      EXPECT_TRUE(seen.insert(row.substr(0, row.rfind(' '))).second) << "twice: " << row;
      const std::string rest = m[1].str().starts_with(family) ? m[1].str().substr(family.size()) : "other family";
      EXPECT_TRUE(kind == "histogram" ? rest == "_bucket" || rest == "_sum" || rest == "_count" : rest.empty()) << row;
      samples.push_back({family, m[1], m[2], std::stod(m[4])});
    } else {
      ADD_FAILURE() << "not a line of the format: " << row;
    }
  }
  return samples;
}

class Metrics : public ApiServer {
 protected:
  std::vector<Sample> read() {
    const auto answer = http_.Get("/metrics");
    EXPECT_EQ(answer->get_header_value("Content-Type"), "text/plain; version=0.0.4; charset=utf-8");
    return parse_metrics(answer->body);
  }
  double value(const std::string& name, const std::string& labels = "") {
    for (const auto& sample : read())
      if (sample.name == name && sample.labels == labels) return sample.value;
    ADD_FAILURE() << "there is no " << name << labels;
    return -1;
  }
};

TEST_F(Metrics, TheWholeTextFollowsTheFormat) { EXPECT_GT(read().size(), 20u); }

TEST_F(Metrics, TellJobsWorkersAndShots) {
  EXPECT_EQ(value("vantage_jobs", R"({kind="render",state="blocked"})"), 6);
  EXPECT_EQ(value("vantage_workers", R"({state="active"})"), 1);
  EXPECT_EQ(value("vantage_shots", R"({state="running"})"), 1);
  EXPECT_GT(value("vantage_database_bytes"), 10'000);
  EXPECT_GT(value("process_resident_memory_bytes"), 1e6);
}

TEST_F(Metrics, TellWhatTheSchedulerDidAndDidNotBelieve) {
  state_.stats.num_claimed = 12;
  state_.stats.num_ended = {{"done", 9}, {"lost", 1}};
  state_.drops.bad_mac = 3;
  state_.broker = Broker::Counts{.num_clients = 2, .num_relayed = 50, .num_dropped = 0};
  state_.stats.turn_s.add(kTurnSeconds, 0.003);
  EXPECT_EQ(value("vantage_claims_total"), 12);
  EXPECT_EQ(value("vantage_attempts_ended_total", R"({outcome="lost"})"), 1);
  EXPECT_EQ(value("vantage_messages_dropped_total", R"({reason="bad_mac"})"), 3);
  EXPECT_EQ(value("vantage_broker_clients"), 2);
  EXPECT_EQ(value("vantage_turn_duration_seconds_bucket", R"({le="0.002"})"), 0);
  EXPECT_EQ(value("vantage_turn_duration_seconds_bucket", R"({le="0.005"})"), 1);
  EXPECT_EQ(value("vantage_scheduler_healthy"), 1);
}

TEST_F(Metrics, CountRequestsByRouteAndStatus) {
  for (int i = 0; i < 3; ++i) http_.Get("/api/v1/shots/1");
  http_.Get("/api/v1/shots/99");
  http_.Get("/no/such/page");
  EXPECT_EQ(value("vantage_http_requests_total", R"({route="shot",status="200"})"), 3);
  EXPECT_EQ(value("vantage_http_requests_total", R"({route="shot",status="404"})"), 1);
  EXPECT_EQ(value("vantage_http_requests_total", R"({route="none",status="404"})"), 1);
  EXPECT_GE(value("vantage_http_request_duration_seconds_count"), 5);
}

TEST_F(Metrics, BucketsOfHistogramsRise) {
  http_.Get("/api/v1/shots");
  double last = 0;
  for (const auto& sample : read())
    if (sample.name == "vantage_http_request_duration_seconds_bucket") {
      EXPECT_GE(sample.value, last) << sample.labels;
      last = sample.value;
    }
  EXPECT_EQ(last, value("vantage_http_request_duration_seconds_count") - 1) << "the count is of one request later";
}

TEST(MetricsText, EscapesWhatLabelsMayNotHold) {
  MetricsText text;
  text.family("a", "gauge", "Help.");
  text.sample(1.5, {{"b", "c\"\\\nd"}});
  EXPECT_EQ(text.text(), "# HELP a Help.\n# TYPE a gauge\na{b=\"c\\\"\\\\\\nd\"} 1.5\n");
}

}  // namespace
}  // namespace vantage
