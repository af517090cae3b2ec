#include "jobs/correspond/epipolar_shift.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace vantage {
namespace {

using Basis = Eigen::Matrix<double, 8, 1>;

constexpr int kStride_px = 3;
constexpr std::size_t kLeastMatches = 400;
/// Deviations beyond this are moving things or wrong, px.
constexpr double kFar_px = 3;

Basis basis_at(const Eigen::Vector2d& px, cv::Size size, double relative_inverse_depth) {
  const double x = 2 * px.x() / size.width - 1, y = 2 * px.y() / size.height - 1, w = relative_inverse_depth;
  Basis basis;
  basis << 1, x, y, x * x, x * y, y * y, w, w * x;
  return basis;
}

struct Sample {
  Basis basis;
  double across_px;
};

/// Iteratively re-weighted least squares with Cauchy weights of the residuals' own scale.
Basis robust_fit(const std::vector<Sample>& samples) {
  Basis fit = Basis::Zero();
  std::vector<double> sizes(samples.size());
  for (int round = 0; round < 10; ++round) {
    for (std::size_t k = 0; k < samples.size(); ++k)
      sizes[k] = std::abs(samples[k].across_px - samples[k].basis.dot(fit));
    auto sorted = sizes;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double scale = std::max(0.01, 1.5 * *middle);
    Eigen::Matrix<double, 8, 8> matrix = Eigen::Matrix<double, 8, 8>::Identity() * 1e-3;
    Basis right = Basis::Zero();
    for (std::size_t k = 0; k < samples.size(); ++k) {
      const double weight = 1 / (1 + sizes[k] * sizes[k] / (scale * scale));
      matrix += weight * samples[k].basis * samples[k].basis.transpose();
      right += weight * samples[k].across_px * samples[k].basis;
    }
    fit = matrix.ldlt().solve(right);
  }
  return fit;
}

}  // namespace

double ShiftedView::shift_px(const Eigen::Vector2d& px, double inverse_depth) const {
  return coefficients.isZero() ? 0 : coefficients.dot(basis_at(px, size, inverse_depth / unit_inverse_depth));
}

LinePoint ShiftedView::line_at(const Eigen::Vector2d& px, double inverse_depth) const {
  const Eigen::Vector3d q = views.homogeneous(px, inverse_depth);
  const double z = std::max(q.z(), 1e-9);
  LinePoint point;
  point.end = {q.x() / z, q.y() / z};
  point.per_inverse_depth = (views.e.head<2>() - point.end * views.e.z()) / z;
  const double speed = point.per_inverse_depth.norm();
  point.across = speed > 0 ? Eigen::Vector2d(-point.per_inverse_depth.y() / speed, point.per_inverse_depth.x() / speed)
                           : Eigen::Vector2d::Zero();
  point.end += shift_px(px, inverse_depth) * point.across;
  return point;
}

double ShiftedView::typical_px_per_inverse_depth(const cv::Mat1f& inverse_depth, const cv::Mat1b& known) const {
  std::vector<double> speeds;
  for (int y = 0; y < known.rows; y += 4)
    for (int x = 0; x < known.cols; x += 4)
      if (known(y, x)) speeds.push_back(views.px_per_inverse_depth({x + 0.5, y + 0.5}, inverse_depth(y, x)));
  if (speeds.empty()) return 0;
  const auto middle = speeds.begin() + static_cast<std::ptrdiff_t>(speeds.size() / 2);
  std::nth_element(speeds.begin(), middle, speeds.end());
  return *middle;
}

ShiftedView fit_shift(const TwoView& views, const cv::Mat2f& motion_px, const cv::Mat1b& known) {
  ShiftedView shifted{views, known.size()};
  std::vector<double> inverse_depths;
  std::vector<Sample> samples;
  for (int y = 0; y < known.rows; y += kStride_px)
    for (int x = 0; x < known.cols; x += kStride_px) {
      if (!known(y, x)) continue;
      const Eigen::Vector2d px(x + 0.5, y + 0.5), end = px + Eigen::Vector2d(motion_px(y, x)[0], motion_px(y, x)[1]);
      const auto fit = fit_inverse_depth(views, px, end);
      if (!fit || fit->residual_px > kFar_px) continue;
      const LinePoint line = shifted.line_at(px, fit->inverse_depth);
      samples.push_back({basis_at(px, known.size(), fit->inverse_depth), (end - line.end).dot(line.across)});
      inverse_depths.push_back(fit->inverse_depth);
    }
  if (samples.size() < kLeastMatches) return shifted;
  const auto late = inverse_depths.begin() + static_cast<std::ptrdiff_t>(inverse_depths.size() * 9 / 10);
  std::nth_element(inverse_depths.begin(), late, inverse_depths.end());
  shifted.unit_inverse_depth = std::max(std::abs(*late), 1e-12);
  for (Sample& sample : samples) sample.basis.tail<2>() /= shifted.unit_inverse_depth;
  shifted.coefficients = robust_fit(samples);
  return shifted;
}

}  // namespace vantage
