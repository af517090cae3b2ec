#pragma once
#include <optional>
#include <string>
#include <vector>

#include "schema/base/ids.h"

namespace vantage {

/// What a person may ask of the running farm. Drain to SelfTest name a worker; all others name one job, or a shot, or
/// one stage of a shot.
struct Command {
  enum class Verb {
    Pause,     ///< start nothing more; of a stage also what is planned later
    Resume,    ///< go on with what was paused
    Cancel,    ///< stop and give up what is unfinished
    Retry,     ///< run bad jobs, and what was aborted for want of them, again
    Rerun,     ///< make finished results again although they are there; what needs them follows if they differ
    Priority,  ///< higher goes first
    Drain,     ///< finish what runs, take nothing new
    Undrain,   ///< take work again
    Hours,     ///< begin jobs only in these hours
    Forgive,   ///< forget what failed there, and trust it again
    SelfTest,  ///< check the machine now; it is set aside when it fails
  };
  Verb verb = Verb::Pause;
  std::optional<ShotId> shot{};
  std::optional<JobId> job{};
  std::string worker{};
  int priority = 0;      ///< with Verb::Priority
  std::string stage{};   ///< with a shot: only the jobs of this kind
  bool dry_run = false;  ///< say what would change, and change nothing
  std::string hours{};   ///< with Verb::Hours, see working_hours.h; empty: always
  std::string who{};     ///< who asks, for the audit log; empty: the farm itself
};

struct CommandResult {
  int num_changed = 0;                  ///< jobs (or workers) that it touched, or would touch
  std::string text{};                   ///< one line for people
  std::vector<std::string> affected{};  ///< names of these jobs, at most kMaxAffected
  static constexpr std::size_t kMaxAffected = 200;
};

}  // namespace vantage
