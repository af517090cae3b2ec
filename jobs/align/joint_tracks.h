#pragma once
#include <vector>

#include "jobs/align/joint_scene.h"
#include "schema/formats/frame_table.h"
#include "schema/formats/matches.h"
#include "schema/formats/tracks.h"

namespace vantage::align {

/// The tracks of a camera, the times of its frames and how long its rows take to be read out.
struct CameraTracks {
  TrackSet tracks;
  FrameTable table;
  double readout_s = 0;
};

/// Tracks that cameras a and b (indices) share.
struct PairTracks {
  std::size_t a = 0, b = 0;
  std::vector<SharedTrack> shared;
};

/// Moving points of two cameras or more: a track and those matched with it, each moved onto the former's surface point
/// as the matches say; every track is of one point at most. Tracks with most cameras come first, at most max_points of
/// them. Only samples of times at which another camera sees the point are kept; of each camera's tracks of a point at
/// one time, the longest.
std::vector<MovingPoint> join_tracks(const std::vector<JointCamera>& cameras, const std::vector<CameraTracks>& tracks,
                                     const std::vector<PairTracks>& pairs, std::size_t max_points);

}  // namespace vantage::align
