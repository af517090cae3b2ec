#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "schema/formats/frame_table.h"
#include "schema/formats/shutter.h"
#include "schema/formats/tracks.h"

namespace vantage::sync {

/// A point's path over its camera's footage time, C1 between frames: cubic Hermite pieces whose tangents are the
/// parabola's through three neighbours. (Straight pieces would shift offsets by up to an eighth of the acceleration.)
class TimedTrack {
 public:
  TimedTrack() = default;
  /// times_s rising, as many as px, at least two.
  TimedTrack(std::vector<double> times_s, std::vector<Eigen::Vector2d> px);

  std::size_t size() const { return times_s_.size(); }
  double time_s(std::size_t k) const { return times_s_[k]; }
  const Eigen::Vector2d& px(std::size_t k) const { return px_[k]; }
  double begin_s() const { return times_s_.front(); }
  double end_s() const { return times_s_.back(); }
  /// Empty outside the track's own time.
  std::optional<Eigen::Vector2d> at(double time_s) const;

  /// px per second, from a straight line through up to seven samples around. Far less noisy than the slope of at(),
  /// whose noise would pass for motion where there is none. std_per_px: its standard deviation per pixel of noise in
  /// the samples.
  struct Velocity {
    Eigen::Vector2d px_per_s = Eigen::Vector2d::Zero();
    double std_per_px = 0;
  };
  Velocity velocity_at(double time_s) const;

  int first_frame = 0;
  int index = -1;  ///< of the track in its TrackSet
  std::vector<std::array<std::uint8_t, 128>> looks;

 private:
  std::size_t piece_of(double time_s) const;  // index of the sample before
  Velocity fitted_velocity(std::size_t k) const;

  std::vector<double> times_s_;
  std::vector<Eigen::Vector2d> px_, tangents_;
  std::vector<Velocity> velocities_;
};

/// The moving tracks of a camera, at most max_tracks of them: those that say most, by extent times length. Each sample
/// at its row's moment; tracks that jump over so many rows that their samples would not follow in time are left out.
std::vector<TimedTrack> moving_tracks(const TrackSet& tracks, const FrameTable& table, std::size_t max_tracks,
                                      double readout_s);

/// Median time between frames.
double frame_interval_s(const FrameTable& table);

}  // namespace vantage::sync
