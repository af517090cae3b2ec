#pragma once
#include "jobs/render/blend.h"

namespace vantage {

/// Colours for the pixels with alpha 0, smoothly from their surroundings, from far surfaces rather than near ones: what
/// came to light was behind something. Alpha, depth and holes stay as they are.
void fill_holes(ViewPicture& picture);

}  // namespace vantage
