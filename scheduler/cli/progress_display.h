#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scheduler/farm/progress.h"

namespace vantage {

/// What people see while a shot runs.
class ProgressDisplay {
 public:
  virtual ~ProgressDisplay() = default;
  virtual void show(const ShotProgress& progress, std::int64_t now_ms) = 0;
  /// A sentence that should stay readable: a warning, a failed job, a restarted worker.
  virtual void say(const std::string& sentence) = 0;
};

/// A bar per stage, redrawn in place.
std::unique_ptr<ProgressDisplay> make_terminal_display();
/// A line whenever a stage ends, and every five seconds: for pipes and logs.
std::unique_ptr<ProgressDisplay> make_plain_display();
/// Nothing at all.
std::unique_ptr<ProgressDisplay> make_silent_display();

/// Remaining time from the mean cost of finished jobs of each stage. Empty while a stage with work left has none.
std::optional<double> remaining_s(const ShotProgress& progress, int num_workers);

/// "####>----", `width` characters: finished, running, waiting.
std::string bar_text(const ShotProgress::Kind& kind, int width);

}  // namespace vantage
