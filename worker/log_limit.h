#pragma once
#include <cstdint>
#include <filesystem>

namespace vantage {

/// Keeps a log that a child appends to from filling the disk: what lies between its beginning and its end is cut out,
/// and a line says how much. The child is never stopped or slowed; lines written at the moment of a cut may be lost.
class LogLimit {
 public:
  struct Sizes {
    std::int64_t head_bytes = 1 << 20;
    std::int64_t tail_bytes = 4 << 20;
  };
  explicit LogLimit(std::filesystem::path file) : LogLimit(std::move(file), Sizes{}) {}
  LogLimit(std::filesystem::path file, Sizes sizes) : file_(std::move(file)), sizes_(sizes) {}

  /// Cuts when the file has grown to twice what is kept.
  void enforce();
  std::int64_t num_cut_bytes() const { return num_cut_bytes_; }

 private:
  std::filesystem::path file_;
  Sizes sizes_;
  std::int64_t num_cut_bytes_ = 0;
  std::int64_t marker_bytes_ = 0;  ///< of our own line in the file
};

}  // namespace vantage
