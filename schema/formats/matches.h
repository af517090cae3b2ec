#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <vector>

namespace vantage {

/// A moving point that two cameras follow. b's track is seldom on the very same surface point: moved by a straight line
/// over time, from first_px at its first sample to last_px at its last, it is.
struct SharedTrack {
  int a = 0, b = 0;  ///< indices into the TrackSets of the pair's cameras
  Eigen::Vector2d first_px = Eigen::Vector2d::Zero(), last_px = Eigen::Vector2d::Zero();
};

/// matches.json of a sync artifact: {"matches": [[a, b, first x, first y, last x, last y], …]}.
void write_matches(const std::filesystem::path& file, const std::vector<SharedTrack>& matches);
/// Throws Error(BadInput) for a file that holds something else.
std::vector<SharedTrack> read_matches(const std::filesystem::path& sync_artifact);

}  // namespace vantage
