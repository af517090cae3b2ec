#pragma once
/// What it costs to say that a pixel has an inverse depth: census bits that differ (Zabih & Woodfill 1994).
#include "jobs/correspond/plane_sweep.h"
#include "jobs/correspond/posed_picture.h"
#include "jobs/correspond/semi_global.h"

namespace vantage {

/// A patch of a slanted surface looks sheared from elsewhere. Where the views differ much, b is looked at also as if
/// all lay on planes that turn about the baseline, like floor and ceiling (Gallup et al. 2007, sweeping directions);
/// what fits best counts.
CostVolume matching_costs(const PosedPicture& a, const PosedPicture& b, const Sweep& sweep);

}  // namespace vantage
