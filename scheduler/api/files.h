#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

namespace vantage {

/// The file of a shot that a request names, e.g. "out/report.html" or ".vantage/store/depth/<key>/preview.jpg". Links
/// may lead from out/ into the store, nowhere else. Empty when there is none or it lies elsewhere.
std::filesystem::path servable_file(const std::filesystem::path& shot_folder, const std::string& relative);

/// By the ending of the name.
std::string content_type(const std::filesystem::path& file);

/// At most max_bytes from offset on; fewer at the end of the file. Empty when it cannot be read.
std::string read_part(const std::filesystem::path& file, std::uintmax_t offset, std::uintmax_t max_bytes);

}  // namespace vantage
