#pragma once
#include <opencv2/core.hpp>

namespace vantage {

/// Weights of the energy and effort. Lengths in px of the size given, grey levels 0–255.
struct VariationalOptions {
  float smoothness = 8;      ///< against one data term
  float gradient_share = 5;  ///< constancy of gradients against constancy of grey levels
  float gradient_noise = 1;  ///< grey levels per px below which a derivative tells nothing
  float data_epsilon_px = 0.01F, smooth_epsilon_px = 0.001F;  ///< where |x| turns into x²
  float edge_contrast = 10;  ///< grey levels per px at which a picture's edge lets motion jump
  int warps = 1, reweightings = 3, sweeps = 10;
};

/// Brox et al. 2004 with normalised derivatives (Zimmer et al. 2011): grey level and gradient constancy, robust
/// smoothness that yields at the picture's edges; linearised again at every warp, reweighted, solved by red-black SOR.
/// from, to: float grey of one size. motion: start and result; trust: 0–1 a pixel, how much its data term counts
/// (empty: all).
void refine_variational(const cv::Mat1f& from, const cv::Mat1f& to, const cv::Mat1f& trust, cv::Mat2f& motion,
                        const VariationalOptions& options);

}  // namespace vantage
