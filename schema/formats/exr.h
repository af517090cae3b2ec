#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace vantage {

/// One channel of a picture, row by row from the top.
struct Plane {
  int width = 0, height = 0;
  std::vector<float> values;
};
using Channels = std::map<std::string, Plane>;  ///< by channel name, all of one size

/// A part of an EXR file. view is empty, "left" or "right".
struct ExrPart {
  std::string view;
  Channels channels;
  std::vector<std::string> half_channels;  ///< written as 16-bit floats; all others 32-bit
  bool compressed = true;                  ///< ZIP; else as it is: for values whose last bits are noise
};

/// Scan lines, one part per entry, same bytes for same input. Throws Error(Resource) when the disk is
/// full.
void write_exr(const std::filesystem::path& path, const std::vector<ExrPart>& parts);
/// All channels of the (first) part whose view is `view`. Throws Error(BadInput) for a truncated or foreign file.
Channels read_exr(const std::filesystem::path& path, const std::string& view = "");

}  // namespace vantage
