#include "jobs/views/disparity_knots.h"

#include <algorithm>
#include <cmath>

namespace vantage {

std::vector<std::vector<KnotWeight>> knot_weights(int num_frames, double fps) {
  constexpr double kSpacing_s = 1;
  const int num_steps = std::max(1, static_cast<int>(std::lround((num_frames - 1) / (kSpacing_s * fps))));
  const double spacing = static_cast<double>(num_frames - 1) / num_steps;
  std::vector<std::vector<KnotWeight>> weights;
  for (int frame = 0; frame < num_frames; ++frame) {
    const int step = spacing > 0 ? std::min(static_cast<int>(frame / spacing), num_steps - 1) : 0;
    const int before = static_cast<int>(std::lround(step * spacing));
    const int after = static_cast<int>(std::lround((step + 1) * spacing));
    const double s = after > before ? std::clamp(1.0 * (frame - before) / (after - before), 0.0, 1.0) : 0;
    const double smooth = s * s * (3 - 2 * s);
    weights.emplace_back();
    if (smooth < 1) weights.back().push_back({before, 1 - smooth});
    if (smooth > 0) weights.back().push_back({after, smooth});
  }
  return weights;
}

}  // namespace vantage
