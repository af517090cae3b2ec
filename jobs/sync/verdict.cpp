#include "jobs/sync/verdict.h"

#include <fmt/format.h>

#include <cmath>

namespace vantage::sync {
namespace {

constexpr double kMinCorrelation = 0.5;
constexpr double kMinAudioContrast = 1.1;
/// Of all samples, so many must agree with the best root's geometry: a wrong one gets about a third by chance.
constexpr double kMinInlierShare = 0.4;
/// From the frame-accurate step to the roots: it is a frame off at most, and the roots a frame more.
constexpr double kMaxMoveFrames = 2;
constexpr double kUnknownStdS = 1e3;

/// Only where it is clearly not 1.
std::string rate_in_words(const OffsetFit& fit) {
  if (fit.rate_std == 0 || std::abs(fit.rate - 1) < 4 * fit.rate_std) return "";
  return fmt::format(", and b's clock runs {:+.0f} ± {:.0f} ppm", 1e6 * (fit.rate - 1), 1e6 * fit.rate_std);
}

}  // namespace

void undetermined(PairOffset& offset, const std::string& why) {
  offset.determined = false;
  offset.verdict = "undetermined: " + why;
  if (offset.std_s == 0) offset.std_s = kUnknownStdS;
}

void judge_fit(PairOffset& offset, const std::optional<OffsetFit>& fit, double contrast, const std::string& cues,
               const VerdictLimits& limits) {
  if (!fit) return undetermined(offset, "nothing that both cameras see tells time");
  offset.offset_s = fit->offset_s;
  offset.rate = fit->rate;
  offset.std_s = fit->std_s;
  offset.rate_std = fit->rate_std;
  offset.pivot_b_s = fit->pivot_b_s;
  offset.num_inliers = fit->num_tracks;
  const double std_frames = fit->std_s / limits.frame_s;
  if (!(std_frames <= limits.max_std_frames))
    return undetermined(
        offset, fmt::format("the motion does not tell time here (± {:.2f} frame, at most {:.2f} is useful)", std_frames,
                            limits.max_std_frames));
  if (fit->effective_tracks < limits.min_tracks)
    return undetermined(offset, fmt::format("rests on {:.1f} tracks, at least {} are needed", fit->effective_tracks,
                                            limits.min_tracks));
  if (contrast < limits.min_contrast)
    return undetermined(offset, fmt::format("another offset fits nearly as well (contrast {:.2f}, expected {:.2f})",
                                            contrast, limits.min_contrast));
  offset.determined = true;
  offset.verdict = fmt::format("{:+.4f} s ± {:.1f} ms ({:.3f} frame) from {} tracks of {}{}", fit->offset_s,
                               1e3 * fit->std_s, std_frames, fit->num_tracks, cues, rate_in_words(*fit));
}

void judge_subframe(PairOffset& offset, const CodeVote& coarse, const std::optional<SubframeVote>& vote,
                    double frame_b_s, const VerdictLimits& limits) {
  offset.offset_s = coarse.offset_s;
  offset.num_inliers = coarse.num_inliers;
  if (coarse.num_inliers < limits.min_tracks) return undetermined(offset, "too few trajectories have matching codes");
  if (!vote) return undetermined(offset, "no nine trajectories agree on a subframe offset");
  offset.offset_s = vote->offset_s;
  offset.std_s = vote->std_s;
  offset.num_inliers = vote->num_inliers;
  if (coarse.contrast < limits.min_contrast)
    return undetermined(offset,
                        fmt::format("another frame's codes match nearly as well (contrast {:.2f})", coarse.contrast));
  if (vote->std > limits.max_std_frames)
    return undetermined(offset, fmt::format("the roots of det M(a) = 0 scatter by {:.2f} frame", vote->std));
  if (vote->inlier_share < kMinInlierShare)
    return undetermined(offset,
                        fmt::format("only {:.0f} % of the points agree with one geometry", 100 * vote->inlier_share));
  const double moved_frames = (vote->offset_s - coarse.offset_s) / frame_b_s;
  if (std::abs(moved_frames) > kMaxMoveFrames)
    return undetermined(offset, fmt::format("the roots lie {:+.1f} frames from the frame-accurate step", moved_frames));
  offset.determined = true;
  offset.verdict = fmt::format("{:+.4f} s ± {:.1f} ms from {} roots of det M(a) = 0", offset.offset_s,
                               1e3 * offset.std_s, vote->num_roots);
}

void judge_mean(PairOffset& offset, const CodeVote& coarse, const std::optional<MeanOfRoots>& mean,
                const VerdictLimits& limits) {
  offset.offset_s = coarse.offset_s;
  offset.num_inliers = coarse.num_inliers;
  if (!mean) return undetermined(offset, "no two frames have twelve trajectories in common");
  offset.offset_s = mean->offset_s;
  offset.std_s = mean->std_s;
  if (coarse.contrast < limits.min_contrast)
    return undetermined(offset,
                        fmt::format("another frame's codes match nearly as well (contrast {:.2f})", coarse.contrast));
  if (mean->std_s > limits.max_std_frames * limits.frame_s)
    return undetermined(offset, fmt::format("the frames' roots scatter: mean ± {:.1f} ms", 1e3 * mean->std_s));
  offset.determined = true;
  offset.verdict = fmt::format("{:+.4f} s ± {:.1f} ms, mean of the roots of {} frames (biased)", mean->offset_s,
                               1e3 * mean->std_s, mean->num_frames);
}

void judge_audio(PairOffset& offset, const std::optional<AudioOffset>& audio) {
  if (!audio) return undetermined(offset, "the sound of the two cameras has nothing in common");
  offset.offset_s = audio->offset_s;
  offset.std_s = audio->std_s;
  if (audio->correlation < kMinCorrelation)
    return undetermined(offset, fmt::format("the sound correlates by {:.2f} only, expected {:.2f}", audio->correlation,
                                            kMinCorrelation));
  if (audio->contrast < kMinAudioContrast)
    return undetermined(offset,
                        fmt::format("the sound fits another offset nearly as well (contrast {:.2f})", audio->contrast));
  offset.determined = true;
  offset.verdict = fmt::format("{:+.3f} s from sound, correlation {:.2f}", audio->offset_s, audio->correlation);
}

}  // namespace vantage::sync
