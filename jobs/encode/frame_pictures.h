#pragma once
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace vantage {

/// How frames become pictures of a film.
struct PictureOptions {
  bool deep = false;                 ///< 16 bit from the EXR file, instead of 8 bit
  bool see_through = false;          ///< alpha is that of a matte: the background shows through
  cv::Vec3f background = {0, 0, 0};  ///< linear light, BGR
};

/// The eyes of a rendered frame (one, or left and right) as sRGB BGR. folder: of the render job. Where alpha only says
/// that nothing is known (not see_through), colours stay as they were filled in.
std::vector<cv::Mat> frame_pictures(const std::filesystem::path& folder, bool stereo, const PictureOptions& options);

}  // namespace vantage
