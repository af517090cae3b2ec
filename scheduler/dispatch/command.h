#pragma once
#include <optional>
#include <string>

#include "schema/base/ids.h"

namespace vantage {

/// What a person may ask of the running farm. Drain and Undrain name a worker, all others a shot or one job.
struct Command {
  enum class Verb { Pause, Resume, Cancel, Retry, Priority, Drain, Undrain };
  Verb verb = Verb::Pause;
  std::optional<ShotId> shot{};
  std::optional<JobId> job{};
  std::string worker{};
  int priority = 0;  ///< with Verb::Priority; higher goes first
};

struct CommandResult {
  int num_changed = 0;  ///< jobs (or workers) that it touched
  std::string text;     ///< one line for people
};

}  // namespace vantage
