#pragma once
#include <Eigen/Core>
#include <vector>

#include "jobs/sync/epipolar_fit.h"
#include "jobs/sync/epipolar_scan.h"
#include "jobs/sync/fundamental_fit.h"

namespace vantage::sync {

/// Whether b's track reaches the moment time_a_s at some offset from min_s to max_s.
bool may_be_seen(const PathPair& pair, double time_a_s, double min_s, double max_s);

/// A maximum of the free scan and the geometry that goes with it.
struct FreeMode {
  double offset_s = 0, score = 0;
  Eigen::Matrix3d F;
};

struct FreeScan {
  OffsetScan curve;             ///< range (with the step taken) and scores, for pictures
  double max_px = 0;            ///< tolerance of the scan
  std::vector<FreeMode> modes;  ///< best first
};

/// Every offset of the range with the fundamental matrix that suits it best, found robustly at each. A sample's vote is
/// how much better than its own median over all offsets it agrees (truncated Sampson distance), so that what fits
/// always does not vote and a short overlap, which any matrix fits, cannot win by its ratio of inliers. The step lets
/// the points of b move by about the tolerance at most. still: matches that hold at every offset; they only steady the
/// geometry. Deterministic.
FreeScan scan_free(const std::vector<PathPair>& pairs, const std::vector<PointMatch>& still, const OffsetRange& range);

}  // namespace vantage::sync
