#pragma once
#include <string>
#include <vector>

#include "jobs/align/clock_graph.h"

namespace vantage::align {

/// SVG: cameras on a circle, a line per pair. Green: used, with its offset ± σ and what the clocks left of it; red:
/// rejected; dashed grey: undetermined. Cameras that are not tied are hollow. Hovering shows a pair's verdict.
std::string graph_picture(const std::vector<GraphCamera>& cameras, const std::vector<PairOffset>& pairs,
                          const ClockSolution& solution);

}  // namespace vantage::align
