#include "scheduler/dispatch/working_hours.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <ctime>

#include "schema/base/error.h"

namespace vantage {
namespace {

using testing::HasSubstr;

/// Central Europe, written out so that no tables of time zones are needed.
class WorkingHoursTest : public testing::Test {
 protected:
  void SetUp() override { set_zone("CET-1CEST,M3.5.0/2,M10.5.0/3"); }
  void TearDown() override { set_zone("UTC0"); }
  static void set_zone(const char* zone) {
    setenv("TZ", zone, 1);
    tzset();
  }
  /// Milliseconds of a moment in UTC.
  static std::int64_t utc(int year, int month, int day, int hour, int minute) {
    std::tm t{};
    t.tm_year = year - 1900, t.tm_mon = month - 1, t.tm_mday = day, t.tm_hour = hour, t.tm_min = minute;
    return std::int64_t{timegm(&t)} * 1000;
  }
  static bool open(const std::string& hours, std::int64_t at) { return WorkingHours::parse(hours).are_open(at); }
};

// 2026-01-05 is a Monday; local time is one hour ahead of UTC in winter, two in summer.

TEST_F(WorkingHoursTest, NoneMeansAlways) {
  EXPECT_TRUE(WorkingHours::parse("").are_open(0));
  EXPECT_FALSE(WorkingHours::parse("").next_opening_ms(0));
}

TEST_F(WorkingHoursTest, NightsGoOnPastMidnightButOnlyAfterTheirOwnDay) {
  const std::string nights = "mon-fri 19:00-07:00";
  EXPECT_FALSE(open(nights, utc(2026, 1, 5, 17, 59)));
  EXPECT_TRUE(open(nights, utc(2026, 1, 5, 18, 0)));    // Monday 19:00
  EXPECT_TRUE(open(nights, utc(2026, 1, 6, 5, 59)));    // Tuesday 06:59
  EXPECT_FALSE(open(nights, utc(2026, 1, 6, 6, 0)));    // Tuesday 07:00
  EXPECT_TRUE(open(nights, utc(2026, 1, 10, 5, 0)));    // Saturday morning belongs to Friday night
  EXPECT_FALSE(open(nights, utc(2026, 1, 10, 20, 0)));  // Saturday night
  EXPECT_FALSE(open(nights, utc(2026, 1, 5, 4, 0))) << "Monday morning belongs to Sunday night";
}

TEST_F(WorkingHoursTest, WholeDaysAndWeekEndsThatWrapTheWeek) {
  EXPECT_TRUE(open("mon-fri 19:00-07:00, sat-sun", utc(2026, 1, 10, 20, 0)));
  EXPECT_TRUE(open("fri-mon", utc(2026, 1, 11, 12, 0)));  // Sunday
  EXPECT_TRUE(open("fri-mon", utc(2026, 1, 5, 12, 0)));
  EXPECT_FALSE(open("fri-mon", utc(2026, 1, 6, 12, 0)));
  EXPECT_TRUE(open("22:00-24:00", utc(2026, 1, 6, 22, 59)));
  EXPECT_FALSE(open("22:00-24:00", utc(2026, 1, 6, 23, 0)));
}

TEST_F(WorkingHoursTest, NextOpeningIsTheFirstMinuteThatIsOpen) {
  const auto hours = WorkingHours::parse("mon-fri 19:00-07:00");
  EXPECT_EQ(hours.next_opening_ms(utc(2026, 1, 10, 12, 30) + 12'345), utc(2026, 1, 12, 18, 0));  // Saturday → Monday
  EXPECT_FALSE(hours.next_opening_ms(utc(2026, 1, 5, 20, 0))) << "open already";
  EXPECT_EQ(weekday_and_time(utc(2026, 1, 12, 18, 0)), "mon 19:00");
}

TEST_F(WorkingHoursTest, TheHandsOfTheClockDecideWhereClocksArePutForward) {
  // 2026-03-29, a Sunday: 02:00 becomes 03:00 at 01:00 UTC.
  EXPECT_TRUE(open("sun 01:00-03:00", utc(2026, 3, 29, 0, 59)));  // 01:59
  EXPECT_FALSE(open("sun 01:00-03:00", utc(2026, 3, 29, 1, 0)));  // 03:00
  EXPECT_EQ(WorkingHours::parse("sun 02:30-05:00").next_opening_ms(utc(2026, 3, 29, 0, 0)), utc(2026, 3, 29, 1, 0));
  EXPECT_EQ(WorkingHours::parse("mon 19:00-20:00").next_opening_ms(utc(2026, 3, 28, 12, 0)), utc(2026, 3, 30, 17, 0));
}

TEST_F(WorkingHoursTest, AnHourThatComesTwiceIsOpenTwice) {
  // 2026-10-25, a Sunday: 03:00 becomes 02:00 at 01:00 UTC.
  EXPECT_TRUE(open("sun 02:00-03:00", utc(2026, 10, 25, 0, 30)));
  EXPECT_TRUE(open("sun 02:00-03:00", utc(2026, 10, 25, 1, 30)));
  EXPECT_FALSE(open("sun 02:00-03:00", utc(2026, 10, 25, 2, 0)));
}

TEST_F(WorkingHoursTest, WhatCannotBeReadIsNamed) {
  const auto error_of = [](const std::string& text) -> std::string {
    try {
      WorkingHours::parse(text);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(error_of("monday"), HasSubstr("'monday' is no day"));
  EXPECT_THAT(error_of("mon 19-07"), HasSubstr("'19-07' is no time of day"));
  EXPECT_THAT(error_of("mon 19:00"), HasSubstr("has no end"));
  EXPECT_THAT(error_of("19:00-19:00"), HasSubstr("ends when it begins"));
  EXPECT_THAT(error_of("25:00-07:00"), HasSubstr("not between 0 and 24"));
  EXPECT_THAT(error_of("24:30-07:00"), HasSubstr("after the end of the day"));
  EXPECT_THAT(error_of("mon,,tue"), HasSubstr("each part"));
}

}  // namespace
}  // namespace vantage
