#pragma once
#include <filesystem>
#include <opencv2/core.hpp>

#include "schema/formats/exr.h"

namespace vantage {

/// Where every pixel of image i is seen in image j: pixel x of i lies at x + motion_px(x) in j (undistorted pixels, x
/// to the right, y down). confidence: 0–1, 0 where occluded or unknown. flow/*.exr in FORMATS.md: channels u, v,
/// confidence.
struct FlowMap {
  cv::Mat2f motion_px;
  cv::Mat1f confidence;
};
FlowMap read_flow(const std::filesystem::path& path);
/// Compressed where most pixels stand still: of other motion ZIP saves little, and takes longer to read than all else.
void write_flow(const std::filesystem::path& path, const FlowMap& flow);

/// Depth along the optical axis in world units, 0 where unknown; confidence 0–1. Channels Z, confidence.
struct DepthMap {
  cv::Mat1f z;
  cv::Mat1f confidence;
};
DepthMap read_depth(const std::filesystem::path& path);
void write_depth(const std::filesystem::path& path, const DepthMap& depth);

Plane to_plane(const cv::Mat1f& mat);
cv::Mat1f to_mat(const Plane& plane);

/// Pictures for people: colour wheel (full saturation at max_px; grey where confidence is 0), turbo over 1/z.
cv::Mat flow_picture(const FlowMap& flow, double max_px);
cv::Mat depth_picture(const DepthMap& depth);

}  // namespace vantage
