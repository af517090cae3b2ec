#pragma once
#include <span>
#include <string>
#include <vector>

#include "schema/formats/shutter.h"

namespace vantage::align {

struct Readout {
  std::string camera;
  double readout_s = 0;
  double std_s = 0;
};

struct ShutterCamera {
  std::string name;
  double frame_s = 0;
};

/// Read-out time of every camera from all of its pairs at once: a single pair knows little more than a difference. Each
/// lies between 0 and its camera's frame; one that the pairs do not tell stays near 0 with a wide standard deviation.
std::vector<Readout> estimate_readouts(std::span<const PairShutter> pairs, std::span<const ShutterCamera> cameras);

}  // namespace vantage::align
