#pragma once
#include <optional>

#include "scheduler/farm/progress.h"
#include "scheduler/store/sqlite.h"

namespace vantage {

/// The progress of a shot as the database has it, through any connection. Empty when there is no such shot.
/// kind_names: in the order of the pipeline.
std::optional<ShotProgress> read_progress(Sqlite& db, ShotId shot, const std::vector<std::string>& kind_names);

}  // namespace vantage
