#include "jobs/views/key_frames.h"

#include <algorithm>
#include <cmath>

#include "jobs/views/monotone_cubic.h"
#include "schema/base/error.h"

namespace vantage {

KeyFrame path_at(const std::vector<KeyFrame>& keys, double at_s) {
  check(!keys.empty(), "a path has a key frame");
  const auto at = [&](double KeyFrame::*value) {
    std::vector<double> times_s, values;
    for (const KeyFrame& key : keys) {
      times_s.push_back(key.at_s);
      values.push_back(key.*value);
    }
    return MonotoneCubic(std::move(times_s), std::move(values))(at_s);
  };
  return {std::clamp(at_s, keys.front().at_s, keys.back().at_s), at(&KeyFrame::time_s), at(&KeyFrame::azimuth_deg),
          at(&KeyFrame::elevation_deg)};
}

std::vector<int> path_frames(const std::vector<KeyFrame>& keys, double fps) {
  constexpr double kSlack = 1e-6;  // 0.7 s at 30 fps is frame 21, however 0.7 * 30 is rounded
  const int first = std::max(0, static_cast<int>(std::ceil(keys.front().at_s * fps - kSlack)));
  const int last = std::max(first, static_cast<int>(std::floor(keys.back().at_s * fps + kSlack)));
  std::vector<int> frames;
  for (int n = first; n <= last; ++n) frames.push_back(n);
  return frames;
}

}  // namespace vantage
