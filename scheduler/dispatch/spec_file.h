#pragma once
#include <filesystem>
#include <string>

#include "schema/formats/job_file.h"

namespace vantage {

/// What a worker reads to run a job. It knows the right one by hash_bytes() of it.
std::string spec_text(const JobFile& job);

/// Written before the orders that name it go out, and checked by its hash: so neither moved into place nor synced; what
/// a power cut leaves is written again. Throws Error(Resource) when it cannot be written.
void write_spec_file(const std::filesystem::path& path, const std::string& text);

}  // namespace vantage
