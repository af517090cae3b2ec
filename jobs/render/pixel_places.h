#pragma once
#include <opencv2/core.hpp>
#include <span>
#include <string>
#include <vector>

#include "jobs/render/source_image.h"

namespace vantage {

/// Where the surface that each pixel of an image shows is in the world at the view's time.
struct PixelPlaces {
  cv::Mat3d world;
  cv::Mat1f confidence;  ///< 0–1; kGuess where the place is only a guess from the surroundings
};
constexpr float kGuess = 0.02F;

struct PlacingOptions {
  std::string method = "auto";  ///< "auto", "correspondence" or "depth"
  double time_s = 0;
  double scene_distance = 1;  ///< depth where nothing at all is known of an image's depth
  std::vector<double> mu;     ///< barycentric weights of the images
};

/// Places of images[i]'s pixels.
/// By depth: the pixel's world point, moved to the view's time along the motion that the nearest other frame of the
/// same camera shows (linear motion); a motion that a static point explains within the maps' error counts as none. By
/// correspondences, Eq. 5–6 of Klose et al. 2011 in the depth-weighted form: X = Σ mu_k X_k with X_k the point on the
/// ray of pixel W_ik(x) of image k. Projected into a view with centre Σ mu_k C_k this is
/// x~ = Σ mu_k z_k Π_k(W_ik(x)) / Σ mu_k z_k, which is the printed formula where all z_k are equal, and right for any
/// centre when depth is known; a point that moves linearly is at its place at time Σ mu_k t_k. (The printed form lacks
/// mu_i.) "correspondence": depth triangulated here from the maps to other cameras. "auto": by depth where it is known,
/// else by correspondences.
PixelPlaces place_pixels(std::span<const SourceImage> images, int i, const PlacingOptions& options);

/// Depth of images[i] from its maps to other cameras' images: each pixel the confidence-weighted mean of 1/z over the
/// maps whose match lies within 2 px of the epipolar line.
DepthMap triangulated_depth(std::span<const SourceImage> images, int i);

}  // namespace vantage
