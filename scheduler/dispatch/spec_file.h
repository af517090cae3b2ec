#pragma once
#include <filesystem>
#include <string>

#include "schema/formats/job_file.h"

namespace vantage {

/// Writes a job file and returns its hash: hash_file() of it, by which a worker knows that it reads the one that was
/// meant. Readers see the old or the new file whole; after a power cut it may be missing and is written again.
std::string write_spec_file(const std::filesystem::path& path, const JobFile& job);

}  // namespace vantage
