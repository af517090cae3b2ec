#pragma once
#include <opencv2/core.hpp>

namespace vantage {

/// How much the colours of far pixels beside a nearer surface are worth, 0–1: the two pixels next to a silhouette hold
/// some of the nearer surface's colour (Zitnick et al. 2004, boundary mattes) and would carry it along as a halo where
/// another image sees the far surface clean. z: depth, > 0 everywhere.
cv::Mat1f worth_behind_edges(const cv::Mat1f& z);

}  // namespace vantage
