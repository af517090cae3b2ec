#pragma once
#include <vector>

#include "jobs/sync/epipolar_pencil.h"
#include "jobs/sync/timed_track.h"
#include "schema/formats/moving_areas.h"

namespace vantage::sync {

/// The epipolar planes that touch a moving thing, over time. A plane that touches a thing touches it in both cameras at
/// the same moment (the frontier points of Cipolla, Åström & Giblin 1995; Sinha & Pollefeys 2004 use them for
/// silhouettes), however unlike the thing looks from the two sides: what cameras far apart can still compare.
struct Frontier {
  bool upper = false;  ///< the moving thing lies on the side of smaller angles
  std::vector<double> times_s, angles_rad;
  double rad_per_px = 0;             ///< where it is
  Eigen::Vector2d through_px{0, 0};  ///< a pixel near by
  double begin_s() const { return times_s.front(); }
  double end_s() const { return times_s.back(); }
  /// Straight between samples; empty outside.
  std::optional<double> at(double time_s) const;
};

/// The frontiers of one camera, each followed until it jumps: where an arm comes out from behind the body another
/// frontier begins. Those where a thing is cut by the picture's rim are left out. Ordered by first sample.
std::vector<Frontier> find_frontiers(const MovingAreas& areas, const FrameTable& table, const EpipolarPencil& pencil,
                                     EpipolarPencil::Side side);

/// In pieces of at most max_s, which are taken as independent; pieces of fewer than five samples are dropped.
std::vector<Frontier> cut_frontiers(const std::vector<Frontier>& frontiers, double max_s);

}  // namespace vantage::sync
