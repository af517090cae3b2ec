#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/support/processes.h"

namespace vantage::e2e {

/// Content hash of every finished job of a shot run by `vantage run`, by job name.
std::map<std::string, std::string> contents_by_job(const std::filesystem::path& shot);
/// How many attempts of each job ended as done.
std::map<std::string, int> done_attempts_by_job(const std::filesystem::path& shot);
/// Number of all attempts made so far.
int num_attempts(const std::filesystem::path& shot);
/// Kinds of the jobs with an attempt whose id is above `after`, each once.
std::vector<std::string> kinds_attempted_after(const std::filesystem::path& shot, int after);

/// Replaces the first occurrence of `from` in a text file; a failed expectation when there is none.
void edit(const std::filesystem::path& file, const std::string& from, const std::string& to);

}  // namespace vantage::e2e
