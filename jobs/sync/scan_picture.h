#pragma once
#include <opencv2/core.hpp>

#include "jobs/sync/epipolar_scan.h"

namespace vantage::sync {

/// Score over offset, 480 px wide, with a line at the answer (green if determined, else red): shows at a glance whether
/// there is one clear peak.
cv::Mat scan_picture(const OffsetScan& scan, double answer_s, bool determined);

}  // namespace vantage::sync
