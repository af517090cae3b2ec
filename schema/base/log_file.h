#pragma once
#include <filesystem>

namespace vantage {

/// From now on what is logged also goes to `file`, e.g. worker.log. When that has max_mb it becomes worker.1.log, that
/// one worker.2.log and so on; num_files of them are kept. Call it before there are other threads that log. Throws
/// Error(Resource) when the file cannot be opened.
void also_log_to(const std::filesystem::path& file, int max_mb, int num_files);

}  // namespace vantage
