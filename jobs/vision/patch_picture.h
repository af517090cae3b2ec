#pragma once
#include <opencv2/core.hpp>
#include <span>

#include "schema/formats/camera.h"
#include "schema/formats/patches.h"

namespace vantage {

/// Patches seen by a camera at a shot time (those that are valid then and face it), nearest in front, as squares of
/// side splat_px. Two pictures of the camera's size: their colours, and their speed (turbo, red at the fastest 2 %).
struct PatchPictures {
  cv::Mat3b colour, speed;
};
PatchPictures patch_pictures(std::span<const Patch> patches, const Pinhole& pinhole,
                             const RigidTransform& cam_from_world, float time_s, int splat_px);

/// Both side by side, 480 px wide in all.
cv::Mat patch_preview(std::span<const Patch> patches, const Pinhole& pinhole, const RigidTransform& cam_from_world,
                      float time_s);

}  // namespace vantage
