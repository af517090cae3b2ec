#include "jobs/sync/motion_offset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "jobs/sync/free_offset.h"

namespace vantage::sync {
namespace {

constexpr int kCandidatesPerTrack = 4;
constexpr double kMaxLookDistance = 0.9;
constexpr double kScanEpipolarPx = 3;
constexpr double kRefinedScanEpipolarPx = 1.5;
/// A rate can be told from an offset only over a long time.
constexpr double kMinRateOverlapS = 20;
constexpr double kMaxFitStepFrames = 2;

struct Coarse {
  double offset_s = 0;
  CodeVote codes;
  OffsetScan scan;
};

std::vector<TrackMatch> mutual_only(std::vector<TrackMatch> matches) {
  std::erase_if(matches, [](const TrackMatch& m) { return !m.mutual; });
  return matches;
}

/// The refined pairs as lists, pair k of one being pair k of the other: what a scan takes.
OffsetScan scan_pairs(const std::vector<PathPair>& pairs, const PairGeometry& geometry, const OffsetRange& range) {
  std::vector<TimedTrack> a, b;
  std::vector<TrackMatch> matches;
  for (const PathPair& pair : pairs) {
    matches.push_back({a.size(), b.size(), 0, true});
    a.push_back(pair.a);
    b.push_back(pair.b);
  }
  return scan_offsets(a, b, matches, geometry, range, kRefinedScanEpipolarPx);
}

/// Offset only; with a long overlap the rate, too, if it is clearly not 1.
std::optional<OffsetFit> fit_pairs(const std::vector<PathPair>& pairs, const MotionInput& in, double overlap_s,
                                   double start_s, double frame_s) {
  const auto fit = fit_offset(pairs, *in.geometry, start_s, kMaxFitStepFrames * frame_s);
  if (!fit || overlap_s < kMinRateOverlapS) return fit;
  const auto with_rate =
      fit_offset(pairs, *in.geometry, fit->offset_s, kMaxFitStepFrames * frame_s, {.estimate_rate = true});
  const bool well_determined = with_rate && with_rate->rate_std * overlap_s < 0.2 * frame_s;
  return well_determined && std::abs(with_rate->rate - 1) > 4 * with_rate->rate_std ? with_rate : fit;
}

struct Refined {
  std::vector<PathPair> pairs;
  OffsetScan scan;
};

Refined refine_at(const MotionInput& in, const std::vector<TrackMatch>& matches, const OffsetRange& range,
                  double offset_s) {
  Refined out{refine_matches(in.a, in.b, matches, in.table_a, in.table_b, in.grey_a, in.grey_b, offset_s), {}};
  out.scan = scan_pairs(out.pairs, *in.geometry, range);
  return out;
}

std::optional<TimeJump> jump_of(const MotionInput& in, const std::vector<PathPair>& pairs, const OffsetFit& fit) {
  return find_time_jump({.pairs = pairs,
                         .residual = residual_by(*in.geometry),
                         .offset_s = fit.offset_s,
                         .rate = fit.rate,
                         .std_px = std::hypot(fit.noise_px, fit.bias_px),
                         .frame_a_s = frame_interval_s(in.table_a),
                         .frame_b_s = frame_interval_s(in.table_b)});
}

void answer_by_epipolar_fit(MotionAnswer& answer, const MotionInput& in, const std::vector<TrackMatch>& matches,
                            const Coarse& coarse, const VerdictLimits& limits) {
  const auto mutual = mutual_only(matches);
  Refined refined = refine_at(in, mutual, coarse.scan.range, coarse.offset_s);
  double start_s = coarse.offset_s,
         contrast = coarse.scan.modes.empty() ? coarse.codes.contrast : coarse.scan.contrast();
  if (!refined.scan.modes.empty()) {
    const double best_s = refined.scan.modes.front().offset_s;
    if (std::abs(best_s - start_s) > kMaxFitStepFrames * limits.frame_s) {
      // True points say something else than look-alikes did: believe them, but only on their own merit.
      refined = refine_at(in, mutual, coarse.scan.range, best_s);
      contrast = refined.scan.contrast();
    } else {
      contrast = std::max(contrast, refined.scan.contrast());
    }
    if (!refined.scan.modes.empty()) start_s = refined.scan.modes.front().offset_s;
    answer.scan = refined.scan;
  } else {
    contrast = 0;
  }
  const double overlap_s = coarse.scan.range.overlap_s(start_s);
  answer.fit = fit_pairs(refined.pairs, in, overlap_s, start_s, limits.frame_s);
  if (answer.fit) answer.jump = jump_of(in, refined.pairs, *answer.fit);
  if (answer.jump) {
    start_s = answer.fit->offset_s + (answer.jump->longer_is_before ? answer.jump->before_s : answer.jump->after_s);
    answer.fit = fit_pairs(longer_piece(refined.pairs, *answer.jump), in, overlap_s, start_s, limits.frame_s);
  }
  answer.contrast = contrast;
  answer.num_matches = refined.pairs.size();
  judge_fit(answer.offset, answer.fit, contrast, limits);
}

/// The scan's best mode as a vote, for the ways that judge votes.
CodeVote as_vote(const OffsetScan& scan, std::size_t num_matches) {
  if (scan.modes.empty()) return {};
  return {scan.modes.front().offset_s, scan.modes.front().score, scan.contrast(), static_cast<int>(num_matches)};
}

}  // namespace

MotionAnswer offset_from_motion(const MotionInput& in, const SyncJob::Params& params) {
  MotionAnswer answer;
  const bool by_geometry = in.geometry && params.coarse == "epipolar";
  const bool fit = in.geometry && params.subframe == "epipolar";
  const std::string subframe = fit || params.subframe != "epipolar" ? params.subframe : "joint";
  answer.offset.method = fmt::format("motion/{}/{}", params.coarse, subframe);
  if (in.a.empty() || in.b.empty()) {
    undetermined(answer.offset, "a camera has no moving tracks");
    return answer;
  }
  const double frame_a_s = frame_interval_s(in.table_a), frame_b_s = frame_interval_s(in.table_b);
  const VerdictLimits limits{.frame_s = std::max(frame_a_s, frame_b_s),
                             .max_std_frames = params.max_std_frames,
                             .min_tracks = params.min_tracks};
  Coarse coarse;
  coarse.scan.range = plausible_offsets(in.table_a, in.table_b, params.max_offset_s);
  const auto matches = match_by_look(in.a, in.b, kCandidatesPerTrack, kMaxLookDistance);
  answer.num_matches = matches.size();
  if (matches.empty() || coarse.scan.range.num() == 0) {
    undetermined(answer.offset,
                 matches.empty() ? "no moving point looks alike in both cameras" : "the clips are too short");
    return answer;
  }
  if (by_geometry) {
    coarse.scan = scan_offsets(in.a, in.b, matches, *in.geometry, coarse.scan.range, kScanEpipolarPx);
    coarse.codes = as_vote(coarse.scan, matches.size());
  } else if (params.coarse == "codes") {
    coarse.codes = vote_by_codes(in.a, in.b, mutual_only(matches), coarse.scan.range);
  }
  if (!fit) {
    const bool coarse_known = by_geometry || params.coarse == "codes";
    answer_without_poses(answer, in, matches, subframe, coarse_known ? std::optional(coarse.codes) : std::nullopt,
                         coarse.scan.range, limits);
    return answer;
  }
  coarse.offset_s = coarse.codes.offset_s;
  answer.scan = coarse.scan;
  if (coarse.codes.num_inliers == 0)
    undetermined(answer.offset, "no offset is better than the others");
  else
    answer_by_epipolar_fit(answer, in, matches, coarse, limits);
  return answer;
}

}  // namespace vantage::sync
