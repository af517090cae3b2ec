#pragma once
#include "jobs/sync/epipolar_fit.h"
#include "jobs/sync/epipolar_scan.h"
#include "jobs/sync/frontier.h"
#include "jobs/sync/motion_barcode.h"

namespace vantage::sync {

/// What two static calibrated cameras need to compare the frontiers of what moves.
struct FrontierInput {
  EpipolarPencil pencil;
  MovingAreas a, b;
};

struct FrontierAnswer {
  OffsetScan scan;
  std::vector<PathPair> pairs;   ///< of frontiers, as points on a line across the epipolar lines
  std::optional<OffsetFit> fit;  ///< empty: no offset stands out, or nothing tells time
};

/// The offset at which the motion barcodes agree, then the maximum likelihood one near it of the frontiers (fit_clock).
FrontierAnswer offset_from_frontiers(const FrontierInput& input, const FrameTable& table_a, const FrameTable& table_b,
                                     const PairGeometry& geometry, const OffsetRange& range);

}  // namespace vantage::sync
