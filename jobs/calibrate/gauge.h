#pragma once
#include "schema/formats/calibration.h"

namespace vantage {

/// Pictures alone leave a world's place, turn and size open. Chosen here: the origin is the median of the sparse
/// points, the median distance of the cameras from it is 1, y points down (mean of the cameras' down axes), z from the
/// cameras to the origin, x to the right. Needs one camera and one point at least.
void normalise_world(Calibration& calibration);

/// World axes that a top view is drawn in: rows right, down, ahead; found from the cameras as above.
Eigen::Matrix3d viewing_axes(const Calibration& calibration);

}  // namespace vantage
