#include "jobs/sync/time_jumps.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace vantage::sync {
namespace {

constexpr double kRunS = 0.5;
constexpr std::size_t kMinRunSamples = 3;
constexpr double kLossScale = 2;
constexpr int kReachFrames = 3;
constexpr int kStepsPerFrame = 10;
/// By a quarter of a frame at most a jump may miss whole frames: offsets of half the data are no better.
constexpr double kMaxMissFrames = 0.25;
/// Runs of one track share its bias, so likelihoods multiply less than they seem to: e^25 asks for some twenty good
/// runs.
constexpr double kMinEvidence = 25;
constexpr std::size_t kMinRunsEachSide = 6;

/// Cost of a run at each offset of the grid.
struct Run {
  double time_a_s = 0;
  std::vector<double> costs;
};

std::vector<double> offset_grid(const JumpInput& in) {
  const double frame_s = std::max(in.frame_a_s, in.frame_b_s);
  const int reach = kReachFrames * kStepsPerFrame + kStepsPerFrame / 2;
  std::vector<double> grid;
  for (int k = -reach; k <= reach; ++k) grid.push_back(k * frame_s / kStepsPerFrame);
  return grid;
}

/// Cost of samples [first, last) of a pair; empty costs when b sees too few of them at some offset.
Run cost_run(const JumpInput& in, const PathPair& pair, std::size_t first, std::size_t last,
             const std::vector<double>& grid) {
  Run run{pair.a.time_s((first + last) / 2), {}};
  for (const double shift_s : grid) {
    double sum = 0;
    std::size_t num = 0;
    for (std::size_t k = first; k < last; ++k) {
      const auto r = in.residual(pair, k, (pair.a.time_s(k) - in.offset_s - shift_s) / in.rate);
      if (!r) continue;
      sum += (*r / in.std_px) * (*r / in.std_px);
      ++num;
    }
    if (num < kMinRunSamples) return {run.time_a_s, {}};
    run.costs.push_back(kLossScale * kLossScale *
                        std::log1p(sum / static_cast<double>(num) / (kLossScale * kLossScale)));
  }
  return run;
}

std::vector<Run> cost_runs(const JumpInput& in, const std::vector<double>& grid) {
  std::vector<Run> runs;
  for (const PathPair& pair : in.pairs)
    for (std::size_t first = 0, k = 1; k <= pair.a.size(); ++k) {
      if (k < pair.a.size() && pair.a.time_s(k) - pair.a.time_s(first) < kRunS) continue;
      if (k - first >= kMinRunSamples)
        if (Run run = cost_run(in, pair, first, k, grid); !run.costs.empty()) runs.push_back(std::move(run));
      first = k;
    }
  std::stable_sort(runs.begin(), runs.end(), [](auto& p, auto& q) { return p.time_a_s < q.time_a_s; });
  return runs;
}

struct Split {
  std::size_t runs_before = 0;
  std::size_t before = 0, after = 0;  // of the grid
  double evidence = 0;
};

std::size_t lowest(const std::vector<double>& v) {
  return static_cast<std::size_t>(std::min_element(v.begin(), v.end()) - v.begin());
}

/// Least cost of an offset that changes steadily, by up to three frames from the first run to the last: what a wrong
/// rate does, and what no jump may be taken for.
double cost_of_drift(const std::vector<Run>& runs, std::size_t num_offsets) {
  const double begin_s = runs.front().time_a_s, length_s = std::max(1e-9, runs.back().time_a_s - begin_s);
  double least = std::numeric_limits<double>::infinity();
  const int reach = kReachFrames * kStepsPerFrame;
  for (int drift = -reach; drift <= reach; drift += 2) {
    std::vector<double> costs(num_offsets, 0);
    for (const Run& run : runs) {
      const auto shift = std::lround(drift * ((run.time_a_s - begin_s) / length_s - 0.5));
      for (std::size_t d = 0; d < num_offsets; ++d)
        costs[d] += run.costs[static_cast<std::size_t>(
            std::clamp(static_cast<long>(d) + shift, 0L, static_cast<long>(num_offsets) - 1))];
    }
    least = std::min(least, costs[lowest(costs)]);
  }
  return least;
}

Split best_split(const std::vector<Run>& runs, std::size_t num_offsets) {
  std::vector<double> before(num_offsets, 0), after(num_offsets, 0);
  for (const Run& run : runs)
    for (std::size_t d = 0; d < num_offsets; ++d) after[d] += run.costs[d];
  const double together = cost_of_drift(runs, num_offsets);
  Split best;
  for (std::size_t k = 0; k + kMinRunsEachSide < runs.size(); ++k) {
    for (std::size_t d = 0; d < num_offsets; ++d) {
      before[d] += runs[k].costs[d];
      after[d] -= runs[k].costs[d];
    }
    if (k + 1 < kMinRunsEachSide) continue;
    const std::size_t p = lowest(before), q = lowest(after);
    const double evidence = 0.5 * (together - before[p] - after[q]);
    if (evidence > best.evidence) best = {k + 1, p, q, evidence};
  }
  return best;
}

}  // namespace

ResidualAt residual_by(const PairGeometry& geometry) {
  return [geometry](const PathPair& pair, std::size_t k, double time_b_s) -> std::optional<double> {
    const auto b = pair.b.at(time_b_s);
    return b ? geometry.residual_px(pair.a.px(k), pair.a.time_s(k), *b, time_b_s) : std::nullopt;
  };
}

ResidualAt residual_by(const Eigen::Matrix3d& F) {
  return [F](const PathPair& pair, std::size_t k, double time_b_s) -> std::optional<double> {
    const auto b = pair.b.at(time_b_s);
    return b ? std::optional(sampson_px(F, pair.a.px(k), *b)) : std::nullopt;
  };
}

std::optional<TimeJump> find_time_jump(const JumpInput& in) {
  const std::vector<double> grid = offset_grid(in);
  const std::vector<Run> runs = cost_runs(in, grid);
  if (runs.size() < 2 * kMinRunsEachSide) return std::nullopt;
  const Split split = best_split(runs, grid.size());
  if (split.evidence < kMinEvidence) return std::nullopt;
  TimeJump jump{.time_a_s = runs[split.runs_before - 1].time_a_s,
                .before_s = grid[split.before],
                .after_s = grid[split.after],
                .evidence = split.evidence};
  const double step_s = jump.after_s - jump.before_s;
  // Lost frames make the stamps that follow too early, so b's loss makes b's first frame seem to be later.
  jump.lost_by_b = step_s > 0;
  const double frames = std::abs(step_s) / (jump.lost_by_b ? in.frame_b_s : in.frame_a_s);
  jump.frames_lost = static_cast<int>(std::lround(frames));
  if (jump.frames_lost == 0 || std::abs(frames - jump.frames_lost) > kMaxMissFrames) return std::nullopt;
  jump.time_b_s = (jump.time_a_s - in.offset_s - jump.before_s) / in.rate;
  jump.longer_is_before = 2 * split.runs_before > runs.size();
  return jump;
}

std::vector<PathPair> longer_piece(const std::vector<PathPair>& pairs, const TimeJump& jump) {
  constexpr std::size_t kMinSamples = 4;
  std::vector<PathPair> out;
  for (const PathPair& pair : pairs) {
    std::vector<double> times_s;
    std::vector<Eigen::Vector2d> px;
    int first_frame = pair.a.first_frame;
    for (std::size_t k = 0; k < pair.a.size(); ++k) {
      const double past_s = pair.a.time_s(k) - jump.time_a_s;
      if (jump.longer_is_before ? past_s > -kRunS : past_s < kRunS) continue;  // the moment is known to a run
      if (times_s.empty()) first_frame = pair.a.first_frame + static_cast<int>(k);
      times_s.push_back(pair.a.time_s(k));
      px.push_back(pair.a.px(k));
    }
    if (px.size() < kMinSamples) continue;
    out.push_back({TimedTrack(std::move(times_s), std::move(px)), pair.b});
    out.back().a.first_frame = first_frame;
  }
  return out;
}

std::string describe(const TimeJump& jump, const std::string& a, const std::string& b) {
  return fmt::format(
      "{} lost {} frame{} at {:.2f} s of its footage, though its time stamps do not show it; the offset "
      "holds {} that",
      jump.lost_by_b ? b : a, jump.frames_lost, jump.frames_lost == 1 ? "" : "s",
      jump.lost_by_b ? jump.time_b_s : jump.time_a_s, jump.longer_is_before ? "before" : "after");
}

}  // namespace vantage::sync
