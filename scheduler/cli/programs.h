#pragma once
#include <filesystem>
#include <string>

#include "schema/base/json.h"

namespace vantage {

/// The program of that name in the folder of this one. Throws Error(Resource) when it is not there.
std::filesystem::path sibling_program(const std::string& name);

/// What `vantage-worker probe FOOTAGE… --json` says: one object per footage, in order (worker/probe_command.h).
/// footage: videos or patterns of stills. Throws Error(Resource) when the program cannot be run.
Json probe_footage_files(const std::vector<std::string>& footage);

}  // namespace vantage
