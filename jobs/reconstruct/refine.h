#pragma once
#include <span>
#include <string>

#include "jobs/reconstruct/photometry.h"

namespace vantage {

/// nonlinear_conjugate_gradient is what the paper uses (Polak-Ribiere, through Ceres). levenberg_marquardt finds the
/// same optimum in about a third of its time, because 1 - NCC is a sum of squares; lbfgs lies between.
enum class Optimizer { levenberg_marquardt, lbfgs, nonlinear_conjugate_gradient };
/// "lm", "lbfgs", "nlcg"
Optimizer optimizer_from(const std::string& word);

struct RefineOptions {
  Optimizer optimizer = Optimizer::levenberg_marquardt;
  bool with_velocity = true;  ///< false: velocity stays as it is (static points)
  int max_iterations = 10;    ///< of Levenberg-Marquardt; the gradient methods get ten times as many
};

struct Refinement {
  TangentPlane plane;
  double cost = 0;  ///< mean over views of r / (1 + 3 r), r = 1 - NCC: robust against views that do not see the patch
  int iterations = 0;
};

/// Cost, gradient and Gauss-Newton Hessian of a plane over views; views that do not hold the patch cost 1/4 (r = 1).
struct PhotoCost {
  double value = 0;
  Vector6d gradient = Vector6d::Zero();
  Matrix6d hessian = Matrix6d::Zero();
};
PhotoCost photo_cost(const ReferenceTexture& texture, const TangentPlane& plane, std::span<const int> views,
                     bool derivatives);

/// Maximises the correlation over depth along the reference ray, normal and velocity: Klose et al. 2011, §6.1.
Refinement refine(const ReferenceTexture& texture, const TangentPlane& start, std::span<const int> views,
                  const RefineOptions& options);

}  // namespace vantage
