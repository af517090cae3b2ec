#pragma once
#include "jobs/sync/audio_offset.h"
#include "jobs/sync/epipolar_fit.h"
#include "jobs/sync/motion_codes.h"
#include "jobs/sync/nine_points.h"
#include "schema/formats/clocks.h"

namespace vantage::sync {

struct VerdictLimits {
  double frame_s = 0;  ///< the longer of the two cameras' frames
  double max_std_frames = 0.4;
  double min_tracks = 5;
  double min_contrast = 1.3;  ///< best offset over the next best
};

/// Each fills offset, rate, std, inliers, determined and the sentence. determined is false when the offset is less
/// certain than max_std_frames, rests on too few tracks, or another offset explains the data nearly as well.
/// cues: what the fit rests on, in words.
void judge_fit(PairOffset& offset, const std::optional<OffsetFit>& fit, double contrast, const std::string& cues,
               const VerdictLimits& limits);
void judge_subframe(PairOffset& offset, const CodeVote& coarse, const std::optional<SubframeVote>& vote,
                    double frame_b_s, const VerdictLimits& limits);
void judge_mean(PairOffset& offset, const CodeVote& coarse, const std::optional<MeanOfRoots>& mean,
                const VerdictLimits& limits);
void judge_audio(PairOffset& offset, const std::optional<AudioOffset>& audio);
/// Nothing could be computed: why.
void undetermined(PairOffset& offset, const std::string& why);

}  // namespace vantage::sync
