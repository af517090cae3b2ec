/// What a calibrated pair costs sync beside reading its pictures, and how far off the answer is. Imitates two cameras
/// 55° apart that film two moving things for a minute (sync_bench 60): outlines on a grid of 320 x 180 cells, and 600
/// followed points a camera of which each looks like four of the other's.
#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "tests/jobs/sync/moving_spheres.h"

namespace vantage::sync {
namespace {

using namespace testing_support;

constexpr double kOffsetS = 0.4123;
constexpr int kTracks = 600, kAlike = 4, kTrackFrames = 40;

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// CPU seconds of the middle one of three runs.
template <class F>
double median_cpu_s(F&& run) {
  std::vector<double> times_s;
  for (int k = 0; k < 3; ++k) {
    const double start_s = cpu_s();
    run();
    times_s.push_back(cpu_s() - start_s);
  }
  std::sort(times_s.begin(), times_s.end());
  return times_s[1];
}

double error_frames(const std::optional<OffsetFit>& fit) {
  return fit ? (fit->offset_s + (fit->rate - 1) * fit->pivot_b_s - kOffsetS) * kFps : 1e9;
}

void bench_outlines(const Rig& rig, double seconds) {
  const auto spheres = two_spheres();
  const FrontierInput in{rig.geometry().pencil(), film(rig, rig.table_a, spheres, 0),
                         film(rig, rig.table_b, spheres, kOffsetS)};
  const auto range = plausible_offsets(rig.table_a, rig.table_b, 10);
  FrontierAnswer answer;
  const double spent_s =
      median_cpu_s([&] { answer = offset_from_frontiers(in, rig.table_a, rig.table_b, rig.geometry(), range); });
  fmt::print(
      R"({{"bench": "sync_outlines", "footage_s": {:.0f}, "offsets": {}, "cpu_s": {:.3f}, "error_frames": {:.4f}}})"
      "\n",
      seconds, range.num(), spent_s, error_frames(answer.fit));
}

void bench_points(const Rig& rig, double seconds) {
  const auto pairs = make_pairs(rig, {.num = kTracks, .offset_s = kOffsetS, .noise_px = 0.3, .wrong_share = 0.2});
  std::vector<TimedTrack> a, b;
  std::vector<PathPair> pieces;
  std::vector<TrackMatch> matches;
  for (std::size_t k = 0; k < pairs.size(); ++k) {  // each seen for a little while, somewhere in the clip
    const std::size_t first = 17 * k % (pairs[k].a.size() - kTrackFrames);
    const auto piece = [&](const TimedTrack& whole) {
      std::vector<double> times_s;
      std::vector<Eigen::Vector2d> px;
      for (std::size_t i = first; i < first + kTrackFrames; ++i)
        times_s.push_back(whole.time_s(i)), px.push_back(whole.px(i));
      return TimedTrack(std::move(times_s), std::move(px));
    };
    a.push_back(piece(pairs[k].a));
    b.push_back(piece(pairs[k].b));
    pieces.push_back({a.back(), b.back()});
    for (std::size_t j = 0; j < kAlike; ++j) matches.push_back({k, (k + 7 * j) % pairs.size(), 0.1, j == 0});
  }
  const auto range = plausible_offsets(rig.table_a, rig.table_b, 10);
  OffsetScan scan;
  std::optional<OffsetFit> fit;
  const double scan_s = median_cpu_s([&] { scan = scan_offsets(a, b, matches, rig.geometry(), range, 3); });
  const double start_s = scan.modes.empty() ? 0 : scan.modes.front().offset_s;
  const double fit_s = median_cpu_s([&] { fit = fit_clock(pieces, rig.geometry(), start_s, 1 / kFps, seconds); });
  fmt::print(
      R"({{"bench": "sync_points", "footage_s": {:.0f}, "tracks": {}, "matches": {}, "offsets": {}, "scan_cpu_s": {:.3f}, "fit_cpu_s": {:.3f}, "error_frames": {:.4f}}})"
      "\n",
      seconds, a.size(), matches.size(), range.num(), scan_s, fit_s, error_frames(fit));
}

}  // namespace
}  // namespace vantage::sync

int main(int argc, char** argv) {
  using namespace vantage::sync;
  const double seconds = argc > 1 ? std::atof(argv[1]) : 60;
  if (seconds < 3) {
    fmt::print(stderr, "usage: sync_bench [seconds of footage, at least 3; default 60]\n");
    return 2;
  }
  const auto rig = testing_support::make_wide_rig(static_cast<int>(seconds * testing_support::kFps), 55);
  bench_outlines(rig, seconds);
  bench_points(rig, seconds);
}
