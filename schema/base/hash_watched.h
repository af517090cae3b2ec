#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace vantage {

/// hash_file() of a large file: on_read is told, about every MB, how many bytes have been read; what it throws breaks
/// the reading off.
std::string hash_file_watched(const std::filesystem::path& path,
                              const std::function<void(std::uintmax_t num_bytes)>& on_read);

}  // namespace vantage
