#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vantage {

/// What a video file says of its pictures (its first picture track), as ffprobe reads it.
struct VideoFacts {
  int width = 0, height = 0;  ///< as stored: before rotation, pixels not squared
  double fps = 0;             ///< average rate that it declares; 30 when it declares none
  int num_promised = 0;       ///< pictures that it declares; 0 when it does not
  std::string codec;          ///< "h264"
  int bits = 8;               ///< per channel
  std::string pixel_aspect;   ///< "4:3": how much wider than high a pixel is; empty when square or untold
  std::string matrix;         ///< from Y'CbCr to R'G'B' as ffmpeg names it, "bt709"; empty when untold
  std::string transfer;       ///< empty when untold
  bool is_interlaced = false;

  /// The matrix to use: as told; untold, BT.709 for HD and larger (720 lines, or wider than 1024), else BT.601, the
  /// rule of players.
  std::string matrix_used() const;
  /// Sentences on what is done to these pictures and what is lost: interlaced, pixels not square, HDR.
  std::vector<std::string> warnings() const;
};

/// scratch: a folder for a temporary file. Throws Error(BadInput) naming the file: not there, empty, not a video, no
/// picture track.
VideoFacts read_video_facts(const std::filesystem::path& video, const std::filesystem::path& scratch);

}  // namespace vantage
