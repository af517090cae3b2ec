#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "schema/base/histogram.h"

namespace vantage {

inline constexpr std::array<double, 7> kAnswerSeconds{0.001, 0.005, 0.02, 0.1, 0.5, 2, 10};

/// Requests by route and status, and how long answers took. From any thread.
class HttpCounts {
 public:
  void add(std::string_view route, int status, std::chrono::duration<double> took) {
    const std::lock_guard lock(mutex_);
    ++num_[{std::string(route), status}];
    took_.add(kAnswerSeconds, took.count());
  }
  std::map<std::pair<std::string, int>, std::int64_t> numbers() const {
    const std::lock_guard lock(mutex_);
    return num_;
  }
  Histogram<kAnswerSeconds.size()> took() const {
    const std::lock_guard lock(mutex_);
    return took_;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::pair<std::string, int>, std::int64_t> num_;
  Histogram<kAnswerSeconds.size()> took_;
};

}  // namespace vantage
