#pragma once
#include <Eigen/Core>
#include <vector>

#include "jobs/views/virtual_view.h"

namespace vantage {

/// Finds points in the cells of a navigation space; made once, asked often.
class NavLocator {
 public:
  explicit NavLocator(const Navspace& navspace);
  /// The cell that holds the point; outside the hull, the nearest place inside. Azimuths a turn apart are the same
  /// place, and of an image that closes a ring the vertex that was there first is told. Coordinates that do not vary
  /// over the vertices (elevation on an arc, time of a frozen moment) are ignored. Two cells that share a facet give
  /// the same weights on it.
  NavLocation locate(const NavPoint& point) const;

 private:
  /// A point of the space on axes made comparable: degrees, and seconds times scale; unused axes are 0.
  Eigen::Vector3d scaled(double azimuth_deg, double elevation_deg, double time_s) const;
  Eigen::Vector3d scaled(const NavPoint& p) const { return scaled(p.azimuth_deg, p.elevation_deg, p.time_s); }

  struct Cell {
    Eigen::Vector3d low, high;  ///< bounding box
    std::size_t simplex = 0;
  };
  struct Best;
  void look_into(const Cell& cell, const Eigen::Vector3d& point, Best& best) const;

  std::vector<std::vector<int>> simplices_;
  std::vector<Eigen::Vector3d> places_;  ///< of the vertices
  std::vector<Cell> cells_;              ///< by rising begin in time: a long shot's cells are not all looked into
  std::vector<int> first_of_;            ///< vertex: the first one of the same image
  double middle_deg_ = 0;                ///< of the azimuths
  double longest_ = 0;                   ///< of the cells, in time
  Eigen::Vector3d used_ = Eigen::Vector3d::Zero();  ///< 1 where an axis varies
  double deg_per_s_ = 1;
};

/// Weights (≥ 0, sum 1) of the point of a simplex that is nearest to `point`. corners: 1 to 4.
std::vector<double> nearest_weights(const std::vector<Eigen::Vector3d>& corners, const Eigen::Vector3d& point);

/// What a second is worth beside a degree: the median angle between joined cameras over the median time between joined
/// frames of one camera.
double degrees_per_second(const Navspace& navspace);

}  // namespace vantage
