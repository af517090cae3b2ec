#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace vantage {

/// When a worker may begin jobs, by the wall clock of the scheduler's local time zone: "mon-fri 19:00-07:00, sat-sun".
/// A value; empty means always.
class WorkingHours {
 public:
  WorkingHours() = default;
  /// "": always. Else parts between commas, each days, times, or both: "mon", "fri-sun", "22:00-06:00",
  /// "mon-fri 19:00-07:00". Times that end before they begin go on into the next day; a part without times is whole
  /// days, one without days is every day; 24:00 is the end of a day. Throws Error(BadInput) with what is wrong.
  static WorkingHours parse(const std::string& text);

  /// wall_ms: since 1970. Where clocks are put forward or back, the hands of the clock decide.
  bool are_open(std::int64_t wall_ms) const;
  /// The first full minute after wall_ms at which they are open; empty when they always are, or already are.
  std::optional<std::int64_t> next_opening_ms(std::int64_t wall_ms) const;
  bool always() const { return parts_.empty(); }

 private:
  /// Days: bit 0 is Sunday, as in std::tm. Minutes of the day; end <= begin: into the next day.
  struct Part {
    unsigned days = 0;
    int begin_min = 0, end_min = 0;
  };
  static Part parse_part(const std::string& text);
  std::vector<Part> parts_;
};

/// "mon 19:00", local time.
std::string weekday_and_time(std::int64_t wall_ms);

}  // namespace vantage
