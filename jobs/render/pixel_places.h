#pragma once
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "jobs/render/placed_row.h"
#include "jobs/render/source_image.h"
#include "jobs/views/virtual_view.h"

namespace vantage {

struct ViewCamera {
  Pinhole pinhole;
  RigidTransform cam_from_world;
  std::optional<DisparityRule> disparity;
};

struct PlacingOptions {
  std::string method = "auto";  ///< "auto", "correspondence", "plain" or "depth"
  double time_s = 0;
  double scene_distance = 1;  ///< depth where nothing at all is known of an image's depth
  std::vector<double> mu;     ///< barycentric weights of the images
};

/// What a place counts that is only a guess from the surroundings.
constexpr float kGuess = 0.02F;

/// Where the surfaces that one image's pixels show lie in a view at the view's time.
/// By depth: the pixel's world point, moved to the view's time along the motion that the nearest other frame of the
/// same camera shows (linear motion); a motion that a static point explains within the maps' error counts as none.
/// Where view and image have nearly one centre, parallax tells nothing and depth, which is least certain where things
/// move, decides nothing: what the other frame shows too is in front of what it hides, and counts more.
/// By correspondences, Eq. 5–6 of Klose et al. 2011 in the depth-weighted form: X = Σ mu_k X_k with X_k the point on
/// the ray of pixel W_ik(x) of image k. Projected into a view with centre Σ mu_k C_k this is
/// x~ = Σ mu_k z_k Π_k(W_ik(x)) / Σ mu_k z_k, which is the printed formula where all z_k are equal, and right for any
/// centre when depth is known; a point that moves linearly is at its place at time Σ mu_k t_k. "correspondence": depth
/// triangulated here from the maps to other cameras. "auto": by depth where it is known, else by correspondences.
/// "plain": x~ = mu_i Π_i(x) + Σ mu_k Π_k(W_ik(x)) in pixels, Π the homographies at infinity: Eq. 6 as printed but for
/// mu_i, which it lacks, so that the weights add up to 1. No depth is known then: what moves most from image to image
/// is in front.
class PixelPlaces {
 public:
  /// All must outlive the places.
  PixelPlaces(std::span<const SourceImage> images, int i, const ViewCamera& view, const PlacingOptions& options);
  cv::Size size() const { return image_.bgr.size(); }
  /// Row y of the image. Many threads may ask at once.
  void row(int y, PlacedRow& out) const;

 private:
  /// From a pixel and its depth to homogeneous pixels of another camera: z * (H * [x y 1]) + h.
  struct Projection {
    Eigen::Matrix3d H;
    Eigen::Vector3d h;
  };
  struct Placed {
    Eigen::Vector3d world;
    float confidence;
  };

  Projection projection_to(const Pinhole& pinhole, const RigidTransform& cam_from_world) const;
  int frame_across() const;
  void static_row(int y, PlacedRow& out) const;
  Placed place(int x, int y) const;
  Placed by_correspondence(int x, int y, const Eigen::Vector3d& here, float trust) const;
  std::optional<Eigen::Vector3d> matched(int k, int x, int y, const Eigen::Vector3d& here) const;
  Eigen::Vector3d motion(int x, int y, const Eigen::Vector3d& here) const;
  double worth_of_depth() const;
  void put_in_order(int y, const std::vector<float>& squared_motion_px, PlacedRow& out) const;
  void plain_row(int y, PlacedRow& out) const;
  void put(const Placed& placed, std::size_t x, PlacedRow& out) const;

  std::span<const SourceImage> images_;
  std::size_t i_;
  const SourceImage& image_;
  const ViewCamera& view_;
  const PlacingOptions& options_;
  DepthMap depth_;
  cv::Mat1f z_;  ///< known everywhere: where depth_ is not, from the surroundings, the far ones first
  int later_;    ///< the frame that tells motion; -1: none
  Projection into_view_, into_later_;
  double depth_counts_ = 1;  ///< 0–1: how far depth decides, worth_of_depth()
  cv::Mat1f seen_later_;     ///< 0–1: shown by that frame too, and no mixed colour; empty where depth alone decides
};

/// Depth of images[i] from its maps to other cameras' images: each pixel the confidence-weighted mean of 1/z over the
/// maps whose match lies within 2 px of the epipolar line.
DepthMap triangulated_depth(std::span<const SourceImage> images, int i);

}  // namespace vantage
