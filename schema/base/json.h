#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>

namespace vantage {

/// Keys are kept sorted, so equal values print equal text: job keys are hashes of it.
using Json = nlohmann::json;

/// Throws Error(BadInput) naming the file, and line and column where it is not JSON; Transient when unreadable.
Json read_json(const std::filesystem::path& path);
/// Pretty-printed, replacing the file in one step.
void write_json(const std::filesystem::path& path, const Json& value);

}  // namespace vantage
