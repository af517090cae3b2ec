#pragma once
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <string>
#include <string_view>

#include "schema/base/error.h"

namespace vantage {

/// Bytes of others may be refused, in one line; they may not find a mistake of ours, nor any other exception.
inline void expect_read_or_refused(const std::function<void()>& read) {
  try {
    read();
  } catch (const Error& e) {
    const bool one_line = std::string_view(e.what()).find('\n') == std::string_view::npos;
    if (e.kind() != ErrorKind::Bug && one_line) return;
    std::cerr << "kind " << to_string(e.kind()) << ": " << e.what() << '\n';
    std::abort();
  }
}

/// A folder of this process alone, for readers that want a file.
inline const std::filesystem::path& scratch_folder() {
  static const std::filesystem::path folder = [] {
    auto path = std::filesystem::temp_directory_path() / ("vantage-fuzz-" + std::to_string(getpid()));
    std::filesystem::create_directories(path);
    std::atexit([] { std::filesystem::remove_all(scratch_folder()); });
    return path;
  }();
  return folder;
}

inline void write_bytes(const std::filesystem::path& file, std::string_view bytes) {
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

/// The first byte says which of several readers gets the rest.
inline unsigned take_choice(std::string_view& bytes, unsigned num_choices) {
  if (bytes.empty()) return 0;
  const auto choice = static_cast<unsigned char>(bytes.front()) % num_choices;
  bytes.remove_prefix(1);
  return choice;
}

}  // namespace vantage
