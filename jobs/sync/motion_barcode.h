#pragma once
#include <Eigen/Core>

#include "jobs/sync/epipolar_scan.h"
#include "schema/formats/moving_areas.h"

namespace vantage::sync {

/// How much moves on each epipolar plane over time (motion barcodes of epipolar lines: Ben-Artzi, Halperin, Werman &
/// Peleg 2016; here with the geometry known). Only planes that both cameras see.
struct MotionBarcode {
  std::vector<double> times_s;  ///< of the frames whose motion is known
  Eigen::MatrixXf amounts;      ///< planes × frames: square root of the number of moving cells
};

struct BarcodePair {
  MotionBarcode a, b;
};

/// Barcodes of the same planes; empty (no frames) when the cameras share none or nothing moves in one of them.
BarcodePair motion_barcodes(const MovingAreas& a, const FrameTable& table_a, const MovingAreas& b,
                            const FrameTable& table_b, const EpipolarPencil& pencil);

/// Correlation over planes and time of what is left of the barcodes without each plane's mean, times the overlap.
OffsetScan scan_barcodes(const BarcodePair& barcodes, const OffsetRange& range);

}  // namespace vantage::sync
