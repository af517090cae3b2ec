#pragma once
#include <string>
#include <vector>

namespace vantage {

/// What footage is, without decoding all of it.
struct FootageProbe {
  int width = 0, height = 0;
  double fps = 0;
  int num_frames = 0;  ///< as the file says; 0 when it does not
  double duration_s = 0;
  bool is_stills = false;
  std::vector<std::string> warnings;  ///< sentences
};

/// path_or_glob: a video, or a pattern of stills, relative to the current folder.
/// Throws Error(BadInput): not there, not a video, not a picture, too small.
FootageProbe probe_footage(const std::string& path_or_glob);

}  // namespace vantage
