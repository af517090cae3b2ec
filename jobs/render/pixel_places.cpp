#include "jobs/render/pixel_places.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "jobs/render/push_pull.h"

namespace vantage {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr float kMinFlowConfidence = 0.1F;

/// Depth for every pixel: known ones as they are, others from their surroundings (smooth in 1/z).
cv::Mat1f filled_depth(const DepthMap& depth, cv::Size size, double fallback) {
  cv::Mat_<cv::Vec<float, 1>> inverse(size, cv::Vec<float, 1>(static_cast<float>(1 / fallback)));
  if (depth.z.empty()) return cv::Mat1f(size, static_cast<float>(fallback));
  cv::Mat1f known(size, 0.0F);
  bool any = false;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      if (depth.z(y, x) > 0) {
        inverse(y, x)[0] = 1 / depth.z(y, x);
        known(y, x) = 1;
        any = true;
      }
  if (any) push_pull<1>(inverse, known);
  cv::Mat1f z(size);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) z(y, x) = 1 / inverse(y, x)[0];
  return z;
}

/// Places of one image's pixels; keeps what does not change from pixel to pixel.
class Placer {
 public:
  Placer(std::span<const SourceImage> images, int i, const PlacingOptions& options)
      : images_(images),
        i_(static_cast<std::size_t>(i)),
        image_(images[i_]),
        options_(options),
        depth_(options.method == "correspondence" ? triangulated_depth(images, i) : image_.depth),
        z_(filled_depth(depth_, image_.bgr.size(), options.scene_distance)),
        later_(frame_across()) {}

  PixelPlaces all() const {
    PixelPlaces places{cv::Mat3d(image_.bgr.size()), cv::Mat1f(image_.bgr.size())};
    for (int y = 0; y < z_.rows; ++y)
      for (int x = 0; x < z_.cols; ++x) {
        const auto [world, confidence] = place(x, y);
        places.world(y, x) = {world.x(), world.y(), world.z()};
        places.confidence(y, x) = confidence;
      }
    return places;
  }

 private:
  struct Placed {
    Vector3d world;
    float confidence;
  };

  Placed place(int x, int y) const {
    const Vector3d here = world_of(image_, {x + 0.5, y + 0.5}, z_(y, x));
    const float known = depth_.z.empty() || depth_.z(y, x) <= 0 ? 0.0F : depth_.confidence(y, x);
    if (options_.method == "correspondence") return by_correspondence(x, y, here, known > 0 ? 1.0F : 0.5F);
    if (known > 0) return {here + motion(x, y, here), std::max(known, kGuess)};
    if (options_.method == "auto") return by_correspondence(x, y, here, 0.3F);
    return {here, kGuess};
  }

  /// X = Σ mu_k X_k over the images that show the point. trust: of places that correspondences alone give.
  Placed by_correspondence(int x, int y, const Vector3d& here, float trust) const {
    Vector3d sum = Vector3d::Zero();
    double seen = 0, mu = 0;
    for (std::size_t k = 0; k < images_.size(); ++k) {
      if (options_.mu[k] <= 0) continue;
      mu += options_.mu[k];
      const std::optional<Vector3d> there = k == i_ ? std::optional(here) : matched(static_cast<int>(k), x, y, here);
      sum += options_.mu[k] * there.value_or(here);
      if (there) seen += options_.mu[k];
    }
    const double rest = 1 - mu;  // weights of images that are not there
    return {sum + rest * here, std::max(kGuess, trust * static_cast<float>(seen))};
  }

  /// The point on the ray of the pixel's match in image k, as deep there as `here` is.
  std::optional<Vector3d> matched(int k, int x, int y, const Vector3d& here) const {
    const auto flow = image_.flows.find(k);
    if (flow == image_.flows.end() || flow->second.confidence(y, x) < kMinFlowConfidence) return std::nullopt;
    const SourceImage& other = images_[static_cast<std::size_t>(k)];
    const double z = (other.cam_from_world * here).z();
    if (z <= 0) return std::nullopt;
    const cv::Vec2f m = flow->second.motion_px(y, x);
    return world_of(other, {x + 0.5 + m[0], y + 0.5 + m[1]}, z);
  }

  /// The image of the same camera whose time lies on the other side of the view's time, or else the nearest in time; -1
  /// when no map leads to one.
  int frame_across() const {
    int best = -1;
    double best_badness = 0;
    for (const auto& [k, flow] : image_.flows) {
      const SourceImage& other = images_[static_cast<std::size_t>(k)];
      if (other.id.camera != image_.id.camera || other.time_s == image_.time_s) continue;
      const double share = (options_.time_s - image_.time_s) / (other.time_s - image_.time_s);
      const double badness = std::abs(share - 0.5);
      if (best >= 0 && badness >= best_badness) continue;
      best = k;
      best_badness = badness;
    }
    return best;
  }

  /// How far the surface moves until the view's time.
  Vector3d motion(int x, int y, const Vector3d& here) const {
    // Maps are right to about 0.3 px: what a static point explains that well does not move; above, fade in.
    constexpr double kStatic_px = 0.35, kMoving_px = 0.9;
    if (later_ < 0) return Vector3d::Zero();
    const FlowMap& flow = image_.flows.at(later_);
    if (flow.confidence(y, x) < kMinFlowConfidence) return Vector3d::Zero();
    const SourceImage& other = images_[static_cast<std::size_t>(later_)];
    const Vector3d still = other.cam_from_world * here;
    if (still.z() <= 0) return Vector3d::Zero();
    const cv::Vec2f m = flow.motion_px(y, x);
    const Vector2d there_px(x + 0.5 + m[0], y + 0.5 + m[1]);
    const double moved_px = (other.pinhole.project(still) - there_px).norm();
    if (moved_px <= kStatic_px) return Vector3d::Zero();
    const double sampled = sample_depth(other.depth.z, there_px);
    const bool plausible = sampled > 0 && std::abs(sampled / still.z() - 1) < 0.1;
    const Vector3d there = world_of(other, there_px, plausible ? sampled : still.z());
    const double share = (options_.time_s - image_.time_s) / (other.time_s - image_.time_s);
    const double fade = std::clamp((moved_px - kStatic_px) / (kMoving_px - kStatic_px), 0.0, 1.0);
    return std::clamp(share, -2.0, 3.0) * fade * (there - here);
  }

  std::span<const SourceImage> images_;
  std::size_t i_;
  const SourceImage& image_;
  const PlacingOptions& options_;
  DepthMap depth_;
  cv::Mat1f z_;
  int later_;
};

}  // namespace

PixelPlaces place_pixels(std::span<const SourceImage> images, int i, const PlacingOptions& options) {
  return Placer(images, i, options).all();
}

}  // namespace vantage
