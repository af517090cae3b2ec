#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "jobs/render/blend.h"
#include "schema/formats/exr_camera.h"

namespace vantage {

struct NamedPicture {
  std::string view;  ///< "", "left" or "right"
  ViewPicture picture;
  ExrCamera camera{};
};

/// One part per view: linear light half R G B A, float Z, half mask.hole and, where motion is known, forward.u and
/// forward.v (px, v up), with the attributes of exr_camera.h.
void write_frame_exr(const std::filesystem::path& path, const std::vector<NamedPicture>& views);
/// 8-bit sRGB with alpha, the views side by side in their order.
cv::Mat frame_png(const std::vector<NamedPicture>& views);

}  // namespace vantage
