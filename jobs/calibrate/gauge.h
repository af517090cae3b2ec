#pragma once
#include <optional>
#include <string>

#include "schema/formats/calibration.h"

namespace vantage {

/// How far apart two cameras are, or a camera and the ground (to: "ground"), in metres.
struct KnownDistance {
  std::string from, to;
  double metres = 0;
};

struct WorldFacts {
  std::optional<double> ground_y;  ///< where the ground plane lies, when one was found: y points down
  bool is_metric = false;
};

/// Pictures alone leave a world's place, turn and size open. Chosen here: the origin is the median of the sparse
/// points; y points down, square to the ground plane, or along the mean of the cameras' down axes where no plane is
/// found; z from the cameras to the origin, x to the right; the median distance of the cameras from the origin is 1, or
/// lengths are metres when one is known. Needs one camera and one point at least. Throws Error(BadInput) when the known
/// distance names a camera that could not be placed, or the ground and none was found.
WorldFacts normalise_world(Calibration& calibration, const std::optional<KnownDistance>& known = {});

/// World axes that a top view is drawn in: rows right, down, ahead; from the cameras' own axes.
Eigen::Matrix3d viewing_axes(const Calibration& calibration);

}  // namespace vantage
