#pragma once
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace vantage {

struct FilmOptions {
  double fps = 30;
  int crf = 18;
  std::string preset = "medium";
  bool side_by_side = false;  ///< marked as frame-packed stereo, left eye on the left
};

/// H.264, yuv420p, faststart, by the ffmpeg program, one thread and no time stamps: same bytes for same pictures.
/// pictures: PNG files of one size in order; odd sizes are padded by a black row or column. scratch: links to the
/// pictures are made there. Throws Error(BadInput) when there are none, Error(Resource) with ffmpeg's last words when
/// it fails.
void write_film(const std::filesystem::path& mp4, const std::vector<std::filesystem::path>& pictures,
                const FilmOptions& options, const std::filesystem::path& scratch);

/// Red–cyan picture of two eyes: least-squares matrix of Dubois, "A projection method to generate anaglyph stereo
/// images", ICASSP 2001. left, right: 8-bit BGR sRGB of one size.
cv::Mat3b anaglyph(const cv::Mat3b& left, const cv::Mat3b& right);

}  // namespace vantage
