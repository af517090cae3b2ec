#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "jobs/calibrate/features.h"

namespace vantage {

struct FeatureMatch {
  int a = 0, b = 0;  ///< indices of features
  bool operator==(const FeatureMatch&) const = default;
};

/// Where the partner of a feature may lie: within max_px of its epipolar line in b, and it of the partner's in a.
struct EpipolarBand {
  Eigen::Matrix3d F;  ///< x_b^T F x_a = 0
  double max_px = 0;
};

/// Pairs of features that are each other's nearest, and nearer than max_ratio times the next (Lowe 2004, §7.1, in both
/// directions). All distances are computed: the result is exact and always the same. With a band only features within
/// it compete. In order of a.
std::vector<FeatureMatch> match_features(const Features& a, const Features& b, double max_ratio,
                                         const std::optional<EpipolarBand>& band = std::nullopt);

}  // namespace vantage
