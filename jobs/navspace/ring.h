#pragma once
#include "schema/formats/navspace.h"

namespace vantage {

/// Closes the space of cameras that stand all around the scene: images of the cameras of lowest azimuth are appended
/// once more, a turn farther on, so that cells lead across the seam. Around means: the gap at the seam is no wider than
/// 1.5 times the next one, and than 60 degrees. Returns whether it did. Vertices as for join_vertices.
bool close_ring(Navspace& navspace);

}  // namespace vantage
