#include "scheduler/dispatch/working_hours.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <ctime>
#include <sstream>
#include <string_view>

#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr std::array<std::string_view, 7> kDays = {"sun", "mon", "tue", "wed", "thu", "fri", "sat"};
constexpr int kMinutesPerDay = 24 * 60;
constexpr std::int64_t kMinuteMs = 60'000;
constexpr unsigned kEveryDay = 0x7F;

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw Error(ErrorKind::BadInput,
              fmt::format("hours '{}': {}; expected e.g. \"mon-fri 19:00-07:00, sat-sun\", or off for no hours at all",
                          text, why));
}

std::tm local_time(std::int64_t wall_ms) {
  const auto seconds = static_cast<std::time_t>(wall_ms / 1000);
  std::tm local{};
  localtime_r(&seconds, &local);
  return local;
}

unsigned day_bit(int day) { return 1U << static_cast<unsigned>(day); }

int parse_day(const std::string& part, std::string_view word) {
  const auto found = std::find(kDays.begin(), kDays.end(), word);
  if (found == kDays.end()) refuse(part, fmt::format("'{}' is no day", word));
  return static_cast<int>(found - kDays.begin());
}

unsigned parse_days(const std::string& part, const std::string& word) {
  const auto dash = word.find('-');
  const int first = parse_day(part, std::string_view(word).substr(0, dash));
  const int last = dash == std::string::npos ? first : parse_day(part, std::string_view(word).substr(dash + 1));
  unsigned days = day_bit(last);
  for (int day = first; day != last; day = (day + 1) % 7) days |= day_bit(day);
  return days;
}

int parse_number(const std::string& part, std::string_view digits, int max) {
  int value = -1;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size() || value < 0 || value > max)
    refuse(part, fmt::format("'{}' is not between 0 and {}", digits, max));
  return value;
}

/// "19:00" in minutes.
int parse_time(const std::string& part, std::string_view word) {
  const auto colon = word.find(':');
  if (colon == std::string_view::npos) refuse(part, fmt::format("'{}' is no time of day", word));
  const int minutes =
      60 * parse_number(part, word.substr(0, colon), 24) + parse_number(part, word.substr(colon + 1), 59);
  if (minutes > kMinutesPerDay) refuse(part, fmt::format("'{}' is after the end of the day", word));
  return minutes;
}

}  // namespace

WorkingHours::Part WorkingHours::parse_part(const std::string& text) {
  Part part{.days = kEveryDay, .begin_min = 0, .end_min = kMinutesPerDay};
  std::istringstream words(text);
  std::vector<std::string> found;
  for (std::string word; words >> word;) found.push_back(word);
  if (found.empty() || found.size() > 2) refuse(text, "each part is days, times, or days and times");
  const bool times_last = found.back().find(':') != std::string::npos;
  if (found.size() == 2 && !times_last) refuse(text, fmt::format("'{}' is no time of day", found.back()));
  if (times_last) {
    const std::string& times = found.back();
    const auto dash = times.find('-');
    if (dash == std::string::npos) refuse(text, fmt::format("'{}' has no end", times));
    part.begin_min = parse_time(text, std::string_view(times).substr(0, dash));
    part.end_min = parse_time(text, std::string_view(times).substr(dash + 1));
    if (part.begin_min == part.end_min) refuse(text, fmt::format("'{}' ends when it begins", times));
  }
  if (found.size() == 2 || !times_last) part.days = parse_days(text, found.front());
  return part;
}

WorkingHours WorkingHours::parse(const std::string& text) {
  WorkingHours hours;
  if (text.empty()) return hours;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) hours.parts_.push_back(parse_part(part));
  return hours;
}

bool WorkingHours::are_open(std::int64_t wall_ms) const {
  if (always()) return true;
  const std::tm now = local_time(wall_ms);
  const int minute = 60 * now.tm_hour + now.tm_min;
  const unsigned today = day_bit(now.tm_wday), yesterday = day_bit((now.tm_wday + 6) % 7);
  return std::any_of(parts_.begin(), parts_.end(), [&](const Part& part) {
    const bool over_midnight = part.end_min <= part.begin_min;
    if (!over_midnight) return (part.days & today) != 0 && minute >= part.begin_min && minute < part.end_min;
    return ((part.days & today) != 0 && minute >= part.begin_min) ||
           ((part.days & yesterday) != 0 && minute < part.end_min);
  });
}

/// Minute by minute: right over every change of the clocks, and asked only when people look.
std::optional<std::int64_t> WorkingHours::next_opening_ms(std::int64_t wall_ms) const {
  if (are_open(wall_ms)) return std::nullopt;
  constexpr int kMinutesAhead = 9 * kMinutesPerDay;  // a week, and a day with another number of hours
  std::int64_t minute_ms = wall_ms - wall_ms % kMinuteMs;
  for (int i = 0; i < kMinutesAhead; ++i)
    if (minute_ms += kMinuteMs; are_open(minute_ms)) return minute_ms;
  return std::nullopt;
}

std::string weekday_and_time(std::int64_t wall_ms) {
  const std::tm t = local_time(wall_ms);
  return fmt::format("{} {:02}:{:02}", kDays[static_cast<std::size_t>(t.tm_wday)], t.tm_hour, t.tm_min);
}

}  // namespace vantage
