#pragma once
#include <optional>
#include <string>

#include "jobs/sync/epipolar_fit.h"
#include "jobs/sync/epipolar_scan.h"

namespace vantage::sync {

/// What one cue says of a pair's offset.
struct Evidence {
  std::string cue;  ///< "points", "outlines"
  std::optional<OffsetFit> fit;
  double contrast = 0;    ///< of its scan: how far the best offset stands out
  double min_tracks = 5;  ///< effective tracks that the fit needs to be believed
};

struct Combined {
  std::optional<OffsetFit> fit;
  double contrast = 0, min_tracks = 5;
  std::string cues;          ///< those that it rests on, "points and outlines"
  std::string disagreement;  ///< not empty: two cues, both sure, contradict each other
};

/// Two independent cues as one: fits that agree within their errors are averaged, weighed by their certainty, and stand
/// out by the product of their contrasts. When they differ, one that is sure speaks alone against one that is not.
/// frame_s: the longer of the two cameras' frames.
Combined combine(const Evidence& p, const Evidence& q, double frame_s, double min_contrast);

}  // namespace vantage::sync
