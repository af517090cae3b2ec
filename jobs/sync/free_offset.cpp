#include "jobs/sync/free_offset.h"

#include <cmath>

#include "jobs/sync/free_pair.h"
#include "jobs/sync/still_points.h"

namespace vantage::sync {
namespace {

std::vector<TrackMatch> mutual_only(std::vector<TrackMatch> matches) {
  std::erase_if(matches, [](const TrackMatch& m) { return !m.mutual; });
  return matches;
}

std::vector<PathPair> as_pairs(const MotionInput& in, const std::vector<TrackMatch>& matches) {
  std::vector<PathPair> pairs;
  for (const TrackMatch& m : matches) pairs.push_back({in.a[m.a], in.b[m.b]});
  return pairs;
}

std::vector<PathPair> refined(const MotionInput& in, const std::vector<TrackMatch>& matches, double offset_s) {
  return refine_matches(in.a, in.b, matches, in.table_a, in.table_b, in.grey_a, in.grey_b, offset_s);
}

/// Look-alikes first; then, where they say, the same points to a fraction of a pixel, searched over the whole range
/// anew: what true points say stands on their own merit.
FreePairAnswer solve_twice(FreePairInput& input, const MotionInput& in, const std::vector<TrackMatch>& matches) {
  input.pairs = as_pairs(in, matches);
  const FreePairAnswer first = solve_free_pair(input);
  if (!first.fit) return first;
  input.pairs = refined(in, matches, first.fit->clock.offset_s);
  return solve_free_pair(input);
}

std::optional<TimeJump> jump_of(const MotionInput& in, const std::vector<PathPair>& pairs, const JointFit& fit) {
  return find_time_jump({.pairs = pairs,
                         .residual = residual_by(fit.F),
                         .offset_s = fit.clock.offset_s,
                         .rate = fit.clock.rate,
                         .std_px = std::hypot(fit.clock.noise_px, fit.clock.bias_px),
                         .frame_a_s = frame_interval_s(in.table_a),
                         .frame_b_s = frame_interval_s(in.table_b)});
}

void note_nine_points(MotionAnswer& answer, const std::optional<SubframeVote>& vote,
                      const std::optional<MeanOfRoots>& mean) {
  if (vote) answer.figures["fundamental_offset_s"] = vote->offset_s;
  if (vote) answer.figures["fundamental_std_s"] = vote->std_s;
  if (mean) answer.figures["mean_of_roots_offset_s"] = mean->offset_s;
  if (mean) answer.figures["mean_of_roots_std_s"] = mean->std_s;
}

void answer_by_nine_points(MotionAnswer& answer, const MotionInput& in, const std::vector<PathPair>& pairs,
                           const std::vector<PointMatch>& still, const std::string& subframe, const CodeVote& coarse,
                           const VerdictLimits& limits) {
  const NinePointInput nine{.pairs = pairs,
                            .still = still,
                            .table_a = in.table_a,
                            .frame_b_s = frame_interval_s(in.table_b),
                            .static_cameras = in.static_cameras};
  const auto vote = align_by_nine_points(nine, coarse.offset_s);
  const auto mean = mean_of_roots(nine, coarse.offset_s);
  note_nine_points(answer, vote, mean);
  answer.contrast = coarse.contrast;
  if (subframe == "mean")
    judge_mean(answer.offset, coarse, mean, limits);
  else
    judge_subframe(answer.offset, coarse, vote, nine.frame_b_s, limits);
}

}  // namespace

void answer_without_poses(MotionAnswer& answer, const MotionInput& in, const std::vector<TrackMatch>& matches,
                          const std::string& subframe, const std::optional<CodeVote>& coarse, const OffsetRange& range,
                          const VerdictLimits& limits) {
  const auto mutual = mutual_only(matches);
  FreePairInput input{.pairs = {}, .still = {}, .range = range, .lens_a = in.lens_a, .lens_b = in.lens_b};
  input.frame_s = limits.frame_s;
  input.width_a_px = in.table_a.width;
  if (in.static_cameras)
    input.still = match_still_points(in.grey_a, in.table_a.num_frames(), in.grey_b, in.table_b.num_frames());
  answer.figures["still_matches"] = static_cast<double>(input.still.size());
  if (subframe != "joint" && coarse) {
    const auto pairs = refined(in, mutual, coarse->offset_s);
    answer.num_matches = pairs.size();
    return answer_by_nine_points(answer, in, pairs, input.still, subframe, *coarse, limits);
  }
  FreePairAnswer free = solve_twice(input, in, mutual);
  if (free.fit) answer.jump = jump_of(in, input.pairs, *free.fit);
  if (answer.jump) {
    input.pairs = longer_piece(input.pairs, *answer.jump);
    free = solve_free_pair(input);
  }
  answer.num_matches = input.pairs.size();
  answer.scan = free.scan.curve;
  answer.contrast = free.lead;
  if (free.fit) answer.fit = free.fit->clock;
  judge_free_pair(answer.offset, free, limits);
  if (subframe == "joint" || !free.fit) return;
  const CodeVote start{free.fit->clock.offset_s, free.scan.modes.front().score, answer.scan.contrast(),
                       static_cast<int>(input.pairs.size())};
  answer_by_nine_points(answer, in, input.pairs, input.still, subframe, start, limits);
}

}  // namespace vantage::sync
