#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "jobs/render/blend.h"

namespace vantage {

struct NamedPicture {
  std::string view;  ///< "", "left" or "right"
  ViewPicture picture;
};

/// One part per view: linear light half R G B A, float Z.
void write_frame_exr(const std::filesystem::path& path, const std::vector<NamedPicture>& views);
/// 8-bit sRGB with alpha, the views side by side in their order.
cv::Mat frame_png(const std::vector<NamedPicture>& views);

}  // namespace vantage
