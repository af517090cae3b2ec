#pragma once
#include <cstdint>

namespace vantage {

/// Time as a value that tests can set. Thread safe.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual std::int64_t monotonic_ms() const = 0;  ///< never goes back: leases, time-outs
  virtual std::int64_t wall_ms() const = 0;       ///< since 1970: what people read
};

/// The machine's clocks.
const Clock& system_clock();

}  // namespace vantage
