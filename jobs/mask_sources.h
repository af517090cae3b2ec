#pragma once
#include <vector>

#include "jobs/job_kind.h"
#include "schema/formats/camera.h"

namespace vantage {

/// Files of a camera's mask, as sources of a job that looks at it through camera_mask() (jobs/vision): one still named
/// "mask/<camera>", or a sequence named "mask/<camera>/<index>", index counting the pictures of the whole footage. None
/// when the camera has no mask. Throws Error(BadInput) with the line of shot.toml when the mask is not there.
std::vector<Source> mask_sources(const Shot& shot, const ShotCamera& camera);

/// The same for a job that looks at one frame only. Throws for a sequence that ends before it, too.
std::vector<Source> mask_sources(const ShotState& state, const ImageId& image);

}  // namespace vantage
