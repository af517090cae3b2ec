#pragma once
#include <Eigen/Core>
#include <vector>

namespace vantage {

/// Delaunay triangulation by Qhull: the columns of points are places in 2 or 3 dimensions; returns the simplices' point
/// numbers, each rising, the list sorted. Simplices flatter than min_volume (area) are left out, points that coincide
/// appear once. Throws Error(BadInput) when all points lie on a line (plane).
std::vector<std::vector<int>> delaunay(const Eigen::MatrixXd& points, double min_volume);

/// Volume (area, length) of a simplex: columns of points picked by corners, one more than there are rows.
double simplex_volume(const Eigen::MatrixXd& points, const std::vector<int>& corners);

}  // namespace vantage
