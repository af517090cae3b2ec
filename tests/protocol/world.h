#pragma once
/// Simulated time: what happens next happens at once. One thread.
#include <fmt/format.h>

#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/protocol/schedule.h"

namespace vantage {

/// A promise of the farm was broken; what() says which.
class Violation : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class World {
 public:
  explicit World(std::uint64_t seed) : dice(seed) {}

  const Dice dice;
  bool calm = false;  ///< no faults any more

  std::int64_t now_ms() const { return now_ms_; }
  void after(std::int64_t delay_ms, std::function<void()> what) {
    events_.emplace(std::pair(now_ms_ + delay_ms, ++num_events_), std::move(what));
  }
  /// The next event of those due until then; false when there is none, and it is then.
  bool step(std::int64_t until_ms) {
    if (events_.empty() || events_.begin()->first.first > until_ms) {
      now_ms_ = until_ms;
      return false;
    }
    auto event = events_.extract(events_.begin());
    now_ms_ = event.key().first;
    event.mapped()();
    return true;
  }
  template <class... Args>
  void note(fmt::format_string<Args...> format, Args&&... args) {
    trace_.push_back(fmt::format("{:>7} ", now_ms_) + fmt::format(format, std::forward<Args>(args)...));
  }
  const std::vector<std::string>& trace() const { return trace_; }

 private:
  std::int64_t now_ms_ = 0;
  std::uint64_t num_events_ = 0;
  std::map<std::pair<std::int64_t, std::uint64_t>, std::function<void()>> events_;
  std::vector<std::string> trace_;
};

}  // namespace vantage
