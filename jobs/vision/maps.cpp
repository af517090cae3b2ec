#include "jobs/vision/maps.h"

#include <algorithm>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "schema/base/error.h"

namespace vantage {
namespace {

const Plane& channel(const Channels& channels, const std::string& name, const std::filesystem::path& path) {
  const auto found = channels.find(name);
  if (found == channels.end()) throw Error(ErrorKind::BadInput, path.string() + ": lacks channel " + name);
  return found->second;
}

}  // namespace

Plane to_plane(const cv::Mat1f& mat) {
  Plane plane{mat.cols, mat.rows, std::vector<float>(mat.total())};
  for (int y = 0; y < mat.rows; ++y)
    std::memcpy(plane.values.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(mat.cols), mat[y],
                sizeof(float) * static_cast<std::size_t>(mat.cols));
  return plane;
}

cv::Mat1f to_mat(const Plane& plane) {
  cv::Mat1f mat(plane.height, plane.width);
  std::memcpy(mat.data, plane.values.data(), sizeof(float) * plane.values.size());
  return mat;
}

FlowMap read_flow(const std::filesystem::path& path) {
  const Channels c = read_exr(path);
  FlowMap flow;
  cv::merge(std::vector<cv::Mat>{to_mat(channel(c, "u", path)), to_mat(channel(c, "v", path))}, flow.motion_px);
  flow.confidence = to_mat(channel(c, "confidence", path));
  return flow;
}

void write_flow(const std::filesystem::path& path, const FlowMap& flow) {
  std::vector<cv::Mat1f> uv(2);
  cv::split(flow.motion_px, uv);
  const bool mostly_still = 2 * cv::countNonZero(uv[0]) < static_cast<int>(uv[0].total());
  write_exr(path,
            {{.view = "",
              .channels = {{"u", to_plane(uv[0])}, {"v", to_plane(uv[1])}, {"confidence", to_plane(flow.confidence)}},
              .half_channels = {"confidence"},
              .compressed = mostly_still}});
}

DepthMap read_depth(const std::filesystem::path& path) {
  const Channels c = read_exr(path);
  return {to_mat(channel(c, "Z", path)), to_mat(channel(c, "confidence", path))};
}

void write_depth(const std::filesystem::path& path, const DepthMap& depth) {
  write_exr(path, {{.view = "",
                    .channels = {{"Z", to_plane(depth.z)}, {"confidence", to_plane(depth.confidence)}},
                    .half_channels = {"confidence"}}});
}

cv::Mat flow_picture(const FlowMap& flow, double max_px) {
  cv::Mat3b hsv(flow.motion_px.size());
  for (int y = 0; y < hsv.rows; ++y)
    for (int x = 0; x < hsv.cols; ++x) {
      const cv::Vec2f m = flow.motion_px(y, x);
      const float angle = cv::fastAtan2(m[1], m[0]);
      const double length = std::min(1.0, static_cast<double>(std::hypot(m[0], m[1])) / std::max(1e-6, max_px));
      const bool known = flow.confidence(y, x) > 0;
      hsv(y, x) = {cv::saturate_cast<uchar>(angle / 2), cv::saturate_cast<uchar>(known ? 255 * length : 0),
                   cv::saturate_cast<uchar>(known ? 255 : 90)};
    }
  cv::Mat bgr;
  cv::cvtColor(hsv, bgr, cv::COLOR_HSV2BGR);
  return bgr;
}

cv::Mat depth_picture(const DepthMap& depth) {
  std::vector<float> inverse;
  for (const float z : depth.z)
    if (z > 0) inverse.push_back(1 / z);
  cv::Mat1b level(depth.z.size(), uchar{0});
  if (inverse.size() < 2) return cv::Mat(depth.z.size(), CV_8UC3, cv::Scalar::all(0));
  const auto at = [&](double share) {
    const auto k = inverse.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(inverse.size() - 1));
    std::nth_element(inverse.begin(), k, inverse.end());
    return *k;
  };
  const float low = at(0.02), high = std::max(at(0.98), low * 1.001F);
  for (int y = 0; y < level.rows; ++y)
    for (int x = 0; x < level.cols; ++x)
      if (depth.z(y, x) > 0) level(y, x) = cv::saturate_cast<uchar>(255 * (1 / depth.z(y, x) - low) / (high - low));
  cv::Mat bgr;
  cv::applyColorMap(level, bgr, cv::COLORMAP_TURBO);
  bgr.setTo(cv::Scalar::all(0), depth.z <= 0);
  return bgr;
}

}  // namespace vantage
