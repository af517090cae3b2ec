#pragma once
/// Epipolar lines as the pictures show them: poses that were estimated put them a fraction of a pixel aside.
#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "jobs/vision/epipolar.h"

namespace vantage {

/// A point of an epipolar line, how it moves with inverse depth, and the unit vector across the line.
struct LinePoint {
  Eigen::Vector2d end, per_inverse_depth, across;
};

/// Two views whose epipolar lines lie aside by a polynomial of place and inverse depth, as errors of pose and lens do.
/// Zero coefficients: where the poses say.
struct ShiftedView {
  TwoView views;
  cv::Size size;  ///< of picture a
  double unit_inverse_depth = 1;
  Eigen::Matrix<double, 8, 1> coefficients = Eigen::Matrix<double, 8, 1>::Zero();

  LinePoint line_at(const Eigen::Vector2d& px, double inverse_depth) const;
  double shift_px(const Eigen::Vector2d& px, double inverse_depth) const;
  /// Median over the known pixels; 0 without any.
  double typical_px_per_inverse_depth(const cv::Mat1f& inverse_depth, const cv::Mat1b& known) const;
};

/// Robust fit of the shift to matches that were found freely. known: 0 where a match does not count. Zero shift when
/// there are too few.
ShiftedView fit_shift(const TwoView& views, const cv::Mat2f& motion_px, const cv::Mat1b& known);

}  // namespace vantage
