#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <ctime>

#include "scheduler/cli/estimate_lines.h"
#include "scheduler/cli/worker_lines.h"

namespace vantage {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// 2026-01-05 00:00 UTC, a Monday.
constexpr std::int64_t kMonday_ms = 1'767'571'200'000;

class LinesTest : public testing::Test {
 protected:
  void SetUp() override {
    setenv("TZ", "UTC0", 1);
    tzset();
  }
  Json worker{{"id", "b3-4f2a"},
              {"host", "b3"},
              {"pool", ""},
              {"tags", ""},
              {"slots", 4},
              {"cores", 16},
              {"ram_mb", 64000},
              {"state", "active"},
              {"last_seen_ms", kMonday_ms - 1000},
              {"build", "1.2"},
              {"trouble", ""},
              {"skew_ms", 300},
              {"hours", ""},
              {"set_aside", ""},
              {"next_opening_ms", nullptr},
              {"running", Json::array()}};
  Json counts{{"done", 73}, {"ready", 25}, {"quarantined", 2}};
  Json estimate{
      {"rest", {{"low_s", 13'200}, {"middle_s", 15'000}, {"high_s", 18'300}, {"unknown_kinds", Json::array()}}},
      {"why", ""},
      {"num_retried", 11}};
};

TEST_F(LinesTest, OrdinaryWorkerIsOneLine) {
  const std::string text = worker_lines(worker, kMonday_ms);
  EXPECT_THAT(text, AllOf(HasSubstr("b3-4f2a"), HasSubstr("on b3, 0 of 4 slots busy"), HasSubstr("version 1.2")));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
  EXPECT_THAT(text, Not(HasSubstr("pool")));
}

TEST_F(LinesTest, WorkerSaysWhatIsOutOfTheOrdinary) {
  worker["pool"] = "night";
  worker["tags"] = "bigmem gpu";
  worker["state"] = "set aside";
  worker["set_aside"] = "self-test failed: disk: no room";
  worker["hours"] = "sat-sun";
  worker["skew_ms"] = -7'200'000;
  EXPECT_THAT(worker_lines(worker, kMonday_ms),
              AllOf(HasSubstr("pool night, tags bigmem gpu"), HasSubstr("self-test failed: disk: no room"),
                    HasSubstr("works sat-sun"), HasSubstr("clock is"), HasSubstr("behind ours")));
}

TEST_F(LinesTest, WorkerOffHoursSaysWhenItOpensAndALostOneSinceWhen) {
  worker["state"] = "off hours";
  worker["next_opening_ms"] = kMonday_ms + 19 * 3'600'000;
  EXPECT_THAT(worker_lines(worker, kMonday_ms), HasSubstr("off hours until mon 19:00"));
  worker["state"] = "lost";
  worker["last_seen_ms"] = kMonday_ms - 180'000;
  EXPECT_THAT(worker_lines(worker, kMonday_ms), HasSubstr("lost 3:00 min ago"));
}

TEST_F(LinesTest, EstimateIsOneHonestSentence) {
  worker["set_aside"] = "disk";
  EXPECT_EQ(estimate_line(counts, estimate, Json::array({worker}), kMonday_ms),
            "73 %, done mon 04:10 (03:40-05:05), 2 quarantined, 11 retried, worker b3-4f2a set aside (disk)");
}

TEST_F(LinesTest, EstimateSaysWhatItDoesNotKnow) {
  estimate["rest"]["unknown_kinds"] = {"render", "encode"};
  EXPECT_THAT(estimate_line(counts, estimate, Json::array(), kMonday_ms),
              HasSubstr("not counting render, encode, of which nothing is known yet"));
  estimate["rest"] = nullptr;
  estimate["why"] = "no worker takes work";
  EXPECT_THAT(estimate_line(counts, estimate, Json::array(), kMonday_ms),
              HasSubstr("end not known: no worker takes work"));
}

}  // namespace
}  // namespace vantage
