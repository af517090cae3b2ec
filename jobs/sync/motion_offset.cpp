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
constexpr double kMaxFitStepFrames = 2;
/// Pieces of frontiers: the two sides of a thing, or one at two times. A wrong one is no danger as a wrong match is:
/// the offset comes from the whole picture's motion.
constexpr double kMinFrontiers = 1.5;
/// Sound that one camera hears later than the other has come up to 50 m farther; its loudness tells a window at best.
constexpr double kSoundSlackS = 0.15;

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

PairShutter shutter_of(const MotionInput& in, const std::vector<PathPair>& pairs, const OffsetFit& fit) {
  return shutter_information({.pairs = pairs,
                              .residual = residual_by(*in.geometry),
                              .clock = fit,
                              .height_a_px = in.table_a.height,
                              .height_b_px = in.table_b.height,
                              .frame_b_s = frame_interval_s(in.table_b)});
}

/// The matched points' part: refined at the coarse offset, scanned again, fitted.
Evidence evidence_of_points(MotionAnswer& answer, const MotionInput& in, const std::vector<TrackMatch>& matches,
                            const Coarse& coarse, const VerdictLimits& limits) {
  const double frame_s = limits.frame_s;
  const auto mutual = mutual_only(matches);
  Refined refined = refine_at(in, mutual, coarse.scan.range, coarse.offset_s);
  Evidence points{"points", std::nullopt, 0, limits.min_tracks};
  if (refined.scan.modes.empty()) return points;
  double start_s = coarse.offset_s;
  const double best_s = refined.scan.modes.front().offset_s;
  if (std::abs(best_s - start_s) > kMaxFitStepFrames * frame_s) {
    // True points say something else than look-alikes did: believe them, but only on their own merit.
    refined = refine_at(in, mutual, coarse.scan.range, best_s);
    points.contrast = refined.scan.contrast();
  } else {
    points.contrast =
        std::max(coarse.scan.modes.empty() ? coarse.codes.contrast : coarse.scan.contrast(), refined.scan.contrast());
  }
  if (!refined.scan.modes.empty()) start_s = refined.scan.modes.front().offset_s;
  const double overlap_s = coarse.scan.range.overlap_s(start_s);
  points.fit = fit_clock(refined.pairs, *in.geometry, start_s, frame_s, overlap_s);
  if (points.fit) answer.jump = jump_of(in, refined.pairs, *points.fit);
  if (answer.jump) {
    start_s = points.fit->offset_s + (answer.jump->longer_is_before ? answer.jump->before_s : answer.jump->after_s);
    points.fit = fit_clock(longer_piece(refined.pairs, *answer.jump), *in.geometry, start_s, frame_s, overlap_s);
  } else if (points.fit) {
    answer.shutter = shutter_of(in, refined.pairs, *points.fit);
  }
  answer.scan = refined.scan;
  answer.num_matches = refined.pairs.size();
  answer.points = std::move(refined.pairs);
  return points;
}

Evidence evidence_of_outlines(MotionAnswer& answer, const MotionInput& in, const OffsetRange& range) {
  // Points that saw the offset change answer for one side of the change; outlines take the clip as a whole.
  if (!in.outlines || answer.jump) return {"outlines", std::nullopt, 0};
  answer.outlines = offset_from_frontiers(*in.outlines, in.table_a, in.table_b, *in.geometry, range);
  return {"outlines", answer.outlines.fit, answer.outlines.scan.contrast(), kMinFrontiers};
}

void answer_by_epipolar_fit(MotionAnswer& answer, const Evidence& points, const Evidence& outlines,
                            const VerdictLimits& limits) {
  const Combined both = combine(points, outlines, limits.frame_s, limits.min_contrast);
  answer.fit = both.fit;
  answer.contrast = both.contrast;
  if (both.cues == outlines.cue) answer.scan = answer.outlines.scan;
  if (!both.disagreement.empty()) {
    if (both.fit) answer.offset.offset_s = both.fit->offset_s;
    undetermined(answer.offset, both.disagreement);
  } else {
    VerdictLimits for_these = limits;
    for_these.min_tracks = both.min_tracks;
    judge_fit(answer.offset, both.fit, both.contrast, both.cues, for_these);
  }
}

std::string nothing_found(const MotionInput& in, const std::vector<TrackMatch>& matches) {
  if (in.a.empty() || in.b.empty()) return "a camera has no moving tracks";
  return matches.empty() ? "no moving point looks alike in both cameras" : "no offset is better than the others";
}

/// The scan's best mode as a vote, for the ways that judge votes.
CodeVote as_vote(const OffsetScan& scan, std::size_t num_matches) {
  if (scan.modes.empty()) return {};
  return {scan.modes.front().offset_s, scan.modes.front().score, scan.contrast(), static_cast<int>(num_matches)};
}

MotionAnswer offset_in_range(const MotionInput& in, const SyncJob::Params& params, const OffsetRange& range) {
  MotionAnswer answer;
  const bool by_geometry = in.geometry && params.coarse == "epipolar";
  const bool fit = in.geometry && params.subframe == "epipolar";
  const std::string subframe = fit || params.subframe != "epipolar" ? params.subframe : "joint";
  answer.offset.method = fmt::format("motion/{}/{}", params.coarse, subframe);
  const double frame_a_s = frame_interval_s(in.table_a), frame_b_s = frame_interval_s(in.table_b);
  const VerdictLimits limits{.frame_s = std::max(frame_a_s, frame_b_s),
                             .max_std_frames = params.max_std_frames,
                             .min_tracks = static_cast<double>(params.min_tracks)};
  Coarse coarse;
  coarse.scan.range = range;
  if (coarse.scan.range.num() == 0) {
    undetermined(answer.offset, "the clips are too short");
    return answer;
  }
  const auto matches = match_by_look(in.a, in.b, kCandidatesPerTrack, kMaxLookDistance);
  answer.num_matches = matches.size();
  if (by_geometry) {
    coarse.scan = scan_offsets(in.a, in.b, matches, *in.geometry, coarse.scan.range, kScanEpipolarPx);
    coarse.codes = as_vote(coarse.scan, matches.size());
  } else if (params.coarse == "codes") {
    coarse.codes = vote_by_codes(in.a, in.b, mutual_only(matches), coarse.scan.range);
  }
  if (!fit && matches.empty()) {
    undetermined(answer.offset, nothing_found(in, matches));
    return answer;
  }
  if (!fit) {
    const bool coarse_known = by_geometry || params.coarse == "codes";
    answer_without_poses(answer, in, matches, subframe, coarse_known ? std::optional(coarse.codes) : std::nullopt,
                         coarse.scan.range, limits);
    return answer;
  }
  coarse.offset_s = coarse.codes.offset_s;
  answer.scan = coarse.scan;
  const bool stands_out = coarse.codes.num_inliers > 0;
  const Evidence none{"points", std::nullopt, 0};
  const Evidence points = stands_out ? evidence_of_points(answer, in, matches, coarse, limits) : none;
  answer_by_epipolar_fit(answer, points, evidence_of_outlines(answer, in, coarse.scan.range), limits);
  if (!answer.fit && !stands_out) undetermined(answer.offset, nothing_found(in, matches));
  return answer;
}

/// The part of a range that lies near what the sound says; empty when none does.
OffsetRange near_sound(OffsetRange range, const AudioOffset& sound) {
  const auto steps_to = [&](double offset_s) { return std::ceil((offset_s - range.min_s) / range.step_s); };
  const double first = std::max(0.0, steps_to(sound.offset_s - kSoundSlackS));
  range.max_s = std::min(range.max_s, sound.offset_s + kSoundSlackS);
  range.min_s += first * range.step_s;
  return range;
}

}  // namespace

MotionAnswer offset_from_motion(const MotionInput& in, const SyncJob::Params& params) {
  const OffsetRange range = plausible_offsets(in.table_a, in.table_b, params.max_offset_s);
  MotionAnswer answer = offset_in_range(in, params, range);
  if (answer.offset.determined || !in.sound) return answer;
  const OffsetRange near = near_sound(range, *in.sound);
  if (near.num() == 0) return answer;
  MotionAnswer again = offset_in_range(in, params, near);
  if (!again.offset.determined) return answer;
  again.offset.method += "/sound";
  again.offset.verdict += fmt::format("; among several, the one that the sound says ({:+.2f} s)", in.sound->offset_s);
  return again;
}

}  // namespace vantage::sync
