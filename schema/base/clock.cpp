#include "schema/base/clock.h"

#include <chrono>

namespace vantage {
namespace {
template <class StdClock>
std::int64_t since_epoch_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(StdClock::now().time_since_epoch()).count();
}

class SystemClock final : public Clock {
 public:
  std::int64_t monotonic_ms() const override { return since_epoch_ms<std::chrono::steady_clock>(); }
  std::int64_t wall_ms() const override { return since_epoch_ms<std::chrono::system_clock>(); }
};
}  // namespace

const Clock& system_clock() {
  static const SystemClock clock;
  return clock;
}

}  // namespace vantage
