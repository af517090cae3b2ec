#pragma once
/// Dense motion between two pictures of which nothing is known: fractions of a pixel where things move little, and
/// jumps of any length.
#include <opencv2/core.hpp>

#include "jobs/correspond/flow_pair.h"

namespace vantage {

struct FreeFlowOptions {
  /// Larger pictures are searched at a smaller size, and the result refined at full size.
  int max_search_pixels = 600'000;
  /// Also look for things that moved farther than a coarse-to-fine search follows. Costs about as much again.
  bool jumps = true;
};

/// Both ways. a and b: 8-bit grey, any difference in contrast between them made alike before (with_levels_of). Every
/// pixel gets a motion, also one that the other picture does not show: the background's, as far as it can be told.
/// round_trip_px tells which are which. The same bits on every run and for any number of threads.
FlowPair free_flow(const cv::Mat1b& a, const cv::Mat1b& b, const FreeFlowOptions& options);

}  // namespace vantage
