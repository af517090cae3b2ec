#include "jobs/correspond/match_images.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "jobs/correspond/dis_flow.h"
#include "jobs/correspond/free_flow.h"
#include "jobs/correspond/fuse_flow.h"
#include "jobs/correspond/settle_flow.h"
#include "jobs/correspond/still_camera_flow.h"

namespace vantage {
namespace {

/// Poses nearer than these (radians; share of the distance between centre and world origin) are one pose.
constexpr double kSamePose = 1e-7;
/// Enough for things that move; the rest is the static scene's.
constexpr int kMaxSearchPixels = 300'000;
/// Standard deviation of the round trip of a good match.
constexpr float kRoundTripSigma_px = 0.7F;

bool same_view(const PosedPicture& a, const PosedPicture& b) {
  const double scale = std::max(1e-12, a.cam_from_world.t.norm());
  const Pinhole &p = a.pinhole, &q = b.pinhole;
  return (a.cam_from_world.R - b.cam_from_world.R).norm() < kSamePose &&
         (a.cam_from_world.t - b.cam_from_world.t).norm() < kSamePose * scale && p.width == q.width &&
         p.height == q.height && p.fx == q.fx && p.fy == q.fy && p.cx == q.cx && p.cy == q.cy;
}

/// From `start` on.
FlowPair search(const cv::Mat1b& a, const cv::Mat1b& b, const FlowPair& start) {
  return {dis_flow(a, b, start.a_to_b), dis_flow(b, a, start.b_to_a)};
}

cv::Mat1f confidence(const cv::Mat2f& motion, const cv::Mat2f& back, float consistent_px) {
  cv::Mat1f round_trip = round_trip_px(motion, back);
  for (float& value : round_trip)
    value = value > consistent_px ? 0.0F : std::exp(-value * value / (2 * kRoundTripSigma_px * kRoundTripSigma_px));
  return round_trip;
}

/// Candidates: what stands still, what moved a little from there, and what is found without knowing of cameras.
FlowPair static_scene_flow(const PosedPicture& a, const PosedPicture& b, const FlowPair& stereo,
                           const MatchOptions& options) {
  const FuseOptions fuse{.consistent_px = options.consistent_px};
  const FlowPair still = fuse_flows(a.grey, b.grey, stereo, search(a.grey, b.grey, stereo), fuse);
  FlowPair flow =
      fuse_flows(a.grey, b.grey, still, free_flow(a.grey, b.grey, {.max_search_pixels = kMaxSearchPixels}), fuse);
  refine_flow(a.grey, b.grey, flow.a_to_b);
  refine_flow(b.grey, a.grey, flow.b_to_a);
  settle_on_lines(a, b, options.consistent_px, flow);
  return flow;
}

}  // namespace

ImageMatch match_images(const PosedPicture& a, const PosedPicture& b, const MatchOptions& options) {
  const PosedPicture levelled{with_levels_of(a.grey, b.grey), b.pinhole, b.cam_from_world};
  ImageMatch match;
  FlowPair flow;
  if (same_view(a, b)) {
    match.model = ImageMatch::Model::FixedCamera;
    flow = still_camera_flow(a.grey, levelled.grey, {});
  } else if (FlowPair stereo; stereo_flow(a, b, options.stereo, stereo)) {
    match.model = ImageMatch::Model::StaticScene;
    flow = static_scene_flow(a, levelled, stereo, options);
  } else {
    flow = free_flow(a.grey, levelled.grey, {});
  }
  match.forward = {flow.a_to_b, confidence(flow.a_to_b, flow.b_to_a, options.consistent_px)};
  match.backward = {flow.b_to_a, confidence(flow.b_to_a, flow.a_to_b, options.consistent_px)};
  return match;
}

double median_epipolar_residual_px(const ImageMatch& match, const PosedPicture& a, const PosedPicture& b) {
  const TwoView views(a.pinhole, a.cam_from_world, b.pinhole, b.cam_from_world);
  std::vector<double> residuals;
  for (int y = 0; y < a.grey.rows; y += 2)
    for (int x = 0; x < a.grey.cols; x += 2) {
      if (match.forward.confidence(y, x) <= 0) continue;
      const cv::Vec2f m = match.forward.motion_px(y, x);
      const Eigen::Vector2d px(x + 0.5, y + 0.5);
      if (const auto fit = fit_inverse_depth(views, px, px + Eigen::Vector2d(m[0], m[1])))
        residuals.push_back(fit->residual_px);
    }
  if (residuals.empty()) return 0;
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  return *middle;
}

double confident_percent(const FlowMap& flow) {
  return 100.0 * cv::countNonZero(flow.confidence > 0) /
         static_cast<double>(std::max<std::size_t>(1, flow.confidence.total()));
}

}  // namespace vantage
