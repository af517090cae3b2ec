#pragma once
/// What can be said of a shot before it runs.
#include <string>
#include <vector>

#include "schema/shot/shot.h"

namespace vantage {

/// A camera's footage as probed.
struct FootageFacts {
  std::string camera, footage;
  int width = 0, height = 0;
  double fps = 0, duration_s = 0;
  int num_frames = 0;  ///< 0: not known before it is read
  std::vector<std::string> warnings;
  std::string error;  ///< empty: it can be used
};

struct StageEstimate {
  std::string kind;
  double num_jobs = 0;
  double cpu_s = 0;
};

/// shot.toml read and every kind's options checked. Throws Error(BadInput), one clear line.
Shot read_checked_shot(const std::filesystem::path& folder);

/// Probes the footage of every camera. Never throws for bad footage: that is in `error`.
std::vector<FootageFacts> probe_shot(const Shot& shot);

/// Throws Error(BadInput) for the first footage that cannot be used.
void require_usable(const std::vector<FootageFacts>& footage);

/// Rough: what the plan will hold and cost on one core, from the size of the footage. Empty stages are left out.
std::vector<StageEstimate> estimate_plan(const Shot& shot, const std::vector<FootageFacts>& footage);

}  // namespace vantage
