#pragma once
#include <Eigen/Core>
#include <vector>

#include "jobs/calibrate/feature_matching.h"
#include "jobs/calibrate/survey.h"

namespace vantage {

struct MatchOptions {
  double max_error_px = 4;  ///< from the epipolar line
  double max_ratio = 0.8;
  double guided_ratio = 0.9;  ///< along epipolar lines there are fewer rivals
};

/// What two pictures show in common.
struct PicturePair {
  int a = 0, b = 0;                   ///< indices of Survey::pictures
  std::vector<FeatureMatch> matches;  ///< of the pictures' features (Picture::feature); empty: nothing in common
  Eigen::Matrix3d F = Eigen::Matrix3d::Zero();  ///< x_b^T F x_a = 0, when there are matches
};

/// Matches features of the two backgrounds, and of what moves at the same moments; finds the one epipolar geometry that
/// holds for all of them (MAGSAC++, Barath et al. 2020) and matches again along its lines. No more than chance gives
/// counts as nothing.
PicturePair match_pictures(const Survey& survey, int a, int b, const MatchOptions& options);

}  // namespace vantage
