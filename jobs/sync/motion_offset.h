#pragma once
#include <map>
#include <string>

#include "jobs/sync/cross_view.h"
#include "jobs/sync/sync_job.h"
#include "jobs/sync/time_jumps.h"
#include "jobs/sync/verdict.h"

namespace vantage::sync {

/// What the motion method looks at.
struct MotionInput {
  FrameTable table_a, table_b;
  std::vector<TimedTrack> a, b;
  std::optional<PairGeometry> geometry;   ///< empty: not calibrated
  std::optional<Pinhole> lens_a, lens_b;  ///< known lenses, also of cameras that have no pose
  bool static_cameras = true;
  GreyFrames grey_a, grey_b;
};

/// What it has to say: the offset, and the scores that led to it (empty after `codes`).
struct MotionAnswer {
  PairOffset offset;
  OffsetScan scan;
  std::optional<OffsetFit> fit;
  std::map<std::string, double> figures;  ///< more for the job's report
  std::optional<TimeJump> jump;           ///< the offset is that of its longer side
  std::size_t num_matches = 0;
  double contrast = 0;
};

/// The two steps of Klose et al. 2011, §4, each in the way that the options choose. Cameras without calibration get the
/// ways that need none.
MotionAnswer offset_from_motion(const MotionInput& input, const SyncJob::Params& params);

}  // namespace vantage::sync
