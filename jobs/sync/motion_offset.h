#pragma once
#include <map>
#include <string>

#include "jobs/sync/cross_view.h"
#include "jobs/sync/evidence.h"
#include "jobs/sync/frontier_offset.h"
#include "jobs/sync/shutter_information.h"
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
  std::optional<FrontierInput> outlines;  ///< of static calibrated cameras
  std::optional<AudioOffset> sound;       ///< what the sound of both says, where it says something
  GreyFrames grey_a, grey_b;
};

/// What it has to say: the offset, and the scores that led to it (empty after `codes`).
struct MotionAnswer {
  PairOffset offset;
  OffsetScan scan;
  std::optional<OffsetFit> fit;
  std::map<std::string, double> figures;  ///< more for the job's report
  std::optional<PairShutter> shutter;     ///< what calibrated cameras' points say of their read-out
  std::optional<TimeJump> jump;           ///< the offset is that of its longer side
  std::vector<PathPair> points;           ///< the matched points that the fit rests on
  FrontierAnswer outlines;                ///< what the outlines of moving things say
  std::size_t num_matches = 0;
  double contrast = 0;
};

/// The two steps of Klose et al. 2011, §4, each in the way that the options choose. Cameras without calibration get the
/// ways that need none. Where both steps are "epipolar" and the cameras static, the outlines of what moves (frontiers)
/// are a second cue: all that cameras far apart have in common. Where motion alone cannot tell (a pendulum fits at
/// every period) and there is sound, the motion is asked again near the offset that the sound says.
MotionAnswer offset_from_motion(const MotionInput& input, const SyncJob::Params& params);

}  // namespace vantage::sync
