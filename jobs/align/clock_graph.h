#pragma once
#include <string>
#include <vector>

#include "schema/formats/clocks.h"

namespace vantage::align {

/// A camera as the clocks see it.
struct GraphCamera {
  std::string name;
  double frame_s = 1.0 / 30;  ///< time between its frames
};

struct GraphOptions {
  double max_inconsistency_std = 4;
  double max_inconsistency_frames = 0.5;
};

/// A determined pair and how far it is from the clocks that came out.
struct PairResidual {
  std::size_t pair = 0;   ///< index into the pairs given
  double residual_s = 0;  ///< of the pair's offset, in a's footage time
  bool rejected = false;
};

struct ClockSolution {
  Clocks clocks;  ///< the reference first, then the others that are tied to it, in order of cameras
  std::vector<PairResidual> residuals;  ///< of determined pairs between tied cameras
  std::vector<std::string> left_out;    ///< cameras that no pair in use ties to the reference
};

/// All clocks from pair offsets: rate_b = rate_a · rate_ab, then at each pair's pivot (t_a, t_b) offset_a + rate_a ·
/// t_a = offset_b + rate_b · t_b, weighed by 1/σ². Rates have a prior of 1 ± 50 ppm, as crystals do, but for cameras
/// whose pairs clearly say that they run otherwise. First least absolute deviations (iterated reweighting, whose answer
/// no single pair can pull), then pairs are rejected one at a time, the worst first, while one is off by more than
/// max_inconsistency_std deviations or max_inconsistency_frames of the slower camera, then least squares with Huber
/// weights. offset_std_s is the posterior's, inflated by the reduced χ², and by what the pairs of
/// one camera err by together. The reference is the first camera if any pair
/// ties it to another, else the first of the largest group that is tied. start_s: offset of the reference. With no
/// determined pair only one camera is in the answer.
ClockSolution solve_clocks(const std::vector<GraphCamera>& cameras, const std::vector<PairOffset>& pairs,
                           double start_s, const GraphOptions& options = {});

}  // namespace vantage::align
