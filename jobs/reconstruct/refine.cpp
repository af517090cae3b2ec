#include "jobs/reconstruct/refine.h"

#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>
#include <glog/logging.h>

#include <Eigen/Dense>
#include <cmath>

#include "schema/base/error.h"

namespace vantage {
namespace {

/// Parameters in units in which the cost is about equally steep: without this, conjugate gradients stall between an
/// inverse depth of 0.2 and a slope of 1e-4. Fixed parameters get a scale of 0.
Vector6d scales_from(const PhotoCost& cost, bool with_velocity) {
  Vector6d scale;
  for (int i = 0; i < 6; ++i) scale(i) = cost.hessian(i, i) > 1e-12 ? 1 / std::sqrt(cost.hessian(i, i)) : 0.0;
  if (!with_velocity) scale.tail<3>().setZero();
  return scale;
}

class CeresCost : public ceres::FirstOrderFunction {
 public:
  CeresCost(const ReferenceTexture& texture, const TangentPlane& start, std::span<const int> views,
            const Vector6d& scale)
      : texture_(texture), start_(start), views_(views), scale_(scale) {}
  TangentPlane plane(const double* z) const {
    return with_parameters(start_, parameters(start_) + scale_.cwiseProduct(Eigen::Map<const Vector6d>(z)));
  }
  bool Evaluate(const double* z, double* cost, double* gradient) const override {
    const PhotoCost c = photo_cost(texture_, plane(z), views_, gradient != nullptr);
    *cost = c.value;
    if (gradient) Eigen::Map<Vector6d>{gradient} = c.gradient.cwiseProduct(scale_);
    return std::isfinite(c.value);
  }
  int NumParameters() const override { return 6; }

 private:
  const ReferenceTexture& texture_;
  const TangentPlane& start_;
  std::span<const int> views_;
  Vector6d scale_;
};

Refinement refine_with_ceres(const ReferenceTexture& texture, const TangentPlane& start, std::span<const int> views,
                             const RefineOptions& options) {
  FLAGS_minloglevel = google::GLOG_ERROR;  // Ceres warns at every restart of conjugate gradients: thousands of lines
  const Vector6d scale = scales_from(photo_cost(texture, start, views, true), options.with_velocity);
  auto* cost = new CeresCost(texture, start, views, scale);  // GradientProblem takes ownership
  const ceres::GradientProblem problem(cost);
  ceres::GradientProblemSolver::Options ceres_options;
  ceres_options.line_search_direction_type =
      options.optimizer == Optimizer::lbfgs ? ceres::LBFGS : ceres::NONLINEAR_CONJUGATE_GRADIENT;
  ceres_options.nonlinear_conjugate_gradient_type = ceres::POLAK_RIBIERE;
  ceres_options.max_num_iterations = 10 * options.max_iterations;
  ceres_options.function_tolerance = 1e-7;
  ceres_options.logging_type = ceres::SILENT;
  ceres::GradientProblemSolver::Summary summary;
  Vector6d z = Vector6d::Zero();
  ceres::Solve(ceres_options, problem, z.data(), &summary);
  return {cost->plane(z.data()), summary.final_cost, static_cast<int>(summary.iterations.size())};
}

/// (H + lambda diag H) step = -gradient on the free parameters; in scaled units, so that H has a unit diagonal.
Vector6d damped_step(const PhotoCost& cost, const Vector6d& scale, double lambda) {
  Matrix6d H = scale.asDiagonal() * cost.hessian * scale.asDiagonal();
  for (int i = 0; i < 6; ++i) H(i, i) = scale(i) > 0 ? H(i, i) + lambda : 1.0;
  const Vector6d step = H.ldlt().solve(-cost.gradient.cwiseProduct(scale));
  return step.cwiseProduct(scale);
}

Refinement refine_with_lm(const ReferenceTexture& texture, const TangentPlane& start, std::span<const int> views,
                          const RefineOptions& options) {
  TangentPlane plane = start;
  PhotoCost cost = photo_cost(texture, plane, views, true);
  const Vector6d scale = scales_from(cost, options.with_velocity);
  double lambda = 1e-2;
  int iteration = 0;
  for (; iteration < options.max_iterations && lambda < 1e3; ++iteration) {
    const TangentPlane trial = with_parameters(plane, parameters(plane) + damped_step(cost, scale, lambda));
    PhotoCost trial_cost = photo_cost(texture, trial, views, true);
    if (!(trial_cost.value < cost.value)) {
      lambda *= 10;
      continue;
    }
    const double gain = cost.value - trial_cost.value;
    plane = trial;
    cost = std::move(trial_cost);
    lambda = std::max(1e-6, lambda / 5);
    if (gain < 1e-4 * cost.value + 1e-9) break;
  }
  return {plane, cost.value, iteration};
}

}  // namespace

Optimizer optimizer_from(const std::string& word) {
  if (word == "lm") return Optimizer::levenberg_marquardt;
  if (word == "lbfgs") return Optimizer::lbfgs;
  check(word == "nlcg", "the parameter's own check lets only lm, lbfgs and nlcg pass");
  return Optimizer::nonlinear_conjugate_gradient;
}

PhotoCost photo_cost(const ReferenceTexture& texture, const TangentPlane& plane, std::span<const int> views,
                     bool derivatives) {
  PhotoCost sum;
  for (const int view : views) {
    const auto c = texture.compare(plane, view, derivatives);
    const double r = c ? 1 - c->ncc : 1.0;
    sum.value += r / (1 + 3 * r);
    if (!c || !derivatives) continue;
    const double weight = 1 / ((1 + 3 * r) * (1 + 3 * r));
    sum.gradient += weight * c->gradient;
    sum.hessian += weight * c->hessian;
  }
  const double count = static_cast<double>(std::max<std::size_t>(1, views.size()));
  sum.value /= count;
  sum.gradient /= count;
  sum.hessian /= count;
  return sum;
}

Refinement refine(const ReferenceTexture& texture, const TangentPlane& start, std::span<const int> views,
                  const RefineOptions& options) {
  return options.optimizer == Optimizer::levenberg_marquardt ? refine_with_lm(texture, start, views, options)
                                                             : refine_with_ceres(texture, start, views, options);
}

}  // namespace vantage
