#include "jobs/sync/timed_track.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "schema/base/error.h"

namespace vantage::sync {
namespace {

constexpr std::size_t kVelocityHalfWindow = 3;

/// Slope at the middle of three points of the parabola through them.
Eigen::Vector2d parabola_slope(double h0, double h1, const Eigen::Vector2d& slope0, const Eigen::Vector2d& slope1) {
  return (h1 * slope0 + h0 * slope1) / (h0 + h1);
}

}  // namespace

TimedTrack::TimedTrack(std::vector<double> times_s, std::vector<Eigen::Vector2d> px)
    : times_s_(std::move(times_s)), px_(std::move(px)), tangents_(px_.size()) {
  check(px_.size() >= 2 && px_.size() == times_s_.size(), "a path has two or more points and a time for each");
  const std::size_t last = px_.size() - 1;
  const auto h = [&](std::size_t k) { return times_s_[k + 1] - times_s_[k]; };
  const auto slope = [&](std::size_t k) -> Eigen::Vector2d { return (px_[k + 1] - px_[k]) / h(k); };
  for (std::size_t k = 1; k < last; ++k) tangents_[k] = parabola_slope(h(k - 1), h(k), slope(k - 1), slope(k));
  tangents_[0] = last > 1 ? Eigen::Vector2d(2 * slope(0) - tangents_[1]) : slope(0);
  for (std::size_t k = 0; k <= last; ++k) velocities_.push_back(fitted_velocity(k));
  tangents_[last] = last > 1 ? Eigen::Vector2d(2 * slope(last - 1) - tangents_[last - 1]) : slope(0);
}

std::optional<Eigen::Vector2d> TimedTrack::at(double time_s) const {
  constexpr double kSlackS = 1e-9;
  if (time_s < begin_s() - kSlackS || time_s > end_s() + kSlackS) return std::nullopt;
  const std::size_t k = piece_of(time_s);
  const double h = times_s_[k + 1] - times_s_[k];
  const double u = (time_s - times_s_[k]) / h, v = 1 - u;
  return v * v * (1 + 2 * u) * px_[k] + u * u * (1 + 2 * v) * px_[k + 1] +
         u * v * h * (v * tangents_[k] - u * tangents_[k + 1]);
}

std::size_t TimedTrack::piece_of(double time_s) const {
  const auto after = std::upper_bound(times_s_.begin() + 1, times_s_.end() - 1, time_s);
  return static_cast<std::size_t>(after - times_s_.begin()) - 1;
}

TimedTrack::Velocity TimedTrack::fitted_velocity(std::size_t k) const {
  const std::size_t first = k - std::min(k, kVelocityHalfWindow),
                    last = std::min(k + kVelocityHalfWindow, px_.size() - 1);
  const auto n = static_cast<double>(last - first + 1);
  double mean = 0, variance = 0;
  for (std::size_t i = first; i <= last; ++i) mean += times_s_[i] / n;
  Eigen::Vector2d covariance = Eigen::Vector2d::Zero();
  for (std::size_t i = first; i <= last; ++i) {
    variance += (times_s_[i] - mean) * (times_s_[i] - mean);
    covariance += (times_s_[i] - mean) * px_[i];
  }
  return {covariance / variance, 1 / std::sqrt(variance)};
}

TimedTrack::Velocity TimedTrack::velocity_at(double time_s) const {
  const std::size_t k = piece_of(time_s);
  const double u = std::clamp((time_s - times_s_[k]) / (times_s_[k + 1] - times_s_[k]), 0.0, 1.0);
  const Velocity &p = velocities_[k], &q = velocities_[k + 1];
  return {(1 - u) * p.px_per_s + u * q.px_per_s, (1 - u) * p.std_per_px + u * q.std_per_px};
}

std::vector<TimedTrack> moving_tracks(const TrackSet& set, const FrameTable& table, std::size_t max_tracks,
                                      double readout_s) {
  std::vector<const Track*> chosen;
  for (const Track& track : set.tracks)
    if (track.moving && track.px.size() >= 2 && !track.looks.empty()) chosen.push_back(&track);
  const auto worth = [](const Track* t) { return t->motion_px * static_cast<float>(t->px.size()); };
  std::stable_sort(chosen.begin(), chosen.end(), [&](auto* a, auto* b) { return worth(a) > worth(b); });
  if (chosen.size() > max_tracks) chosen.resize(max_tracks);

  std::vector<TimedTrack> out;
  for (const Track* track : chosen) {
    check(track->first_frame >= 0 && track->last_frame() < table.num_frames(), "tracks lie within their footage");
    const auto first = table.pts_s.begin() + track->first_frame;
    std::vector<Eigen::Vector2d> px;
    for (const auto& p : track->px) px.push_back(p.cast<double>());
    std::vector<double> times_s(first, first + static_cast<std::ptrdiff_t>(px.size()));
    for (std::size_t k = 0; k < px.size(); ++k) times_s[k] += row_delay_s(px[k].y(), set.height, readout_s);
    if (std::adjacent_find(times_s.begin(), times_s.end(), std::greater_equal<>()) != times_s.end()) continue;
    TimedTrack timed(std::move(times_s), std::move(px));
    timed.first_frame = track->first_frame;
    timed.index = static_cast<int>(track - set.tracks.data());
    for (const auto& look : track->looks) timed.looks.push_back(look.descriptor);
    out.push_back(std::move(timed));
  }
  return out;
}

double frame_interval_s(const FrameTable& table) {
  std::vector<double> intervals(table.pts_s.size());
  std::adjacent_difference(table.pts_s.begin(), table.pts_s.end(), intervals.begin());
  if (intervals.size() < 2) return table.fps > 0 ? 1 / table.fps : 1;
  const auto middle = intervals.begin() + 1 + static_cast<std::ptrdiff_t>((intervals.size() - 1) / 2);
  std::nth_element(intervals.begin() + 1, middle, intervals.end());
  return *middle;
}

}  // namespace vantage::sync
