#include "jobs/views/key_frames.h"

#include <algorithm>
#include <cmath>

#include "schema/base/error.h"

namespace vantage {
namespace {

using Values = double KeyFrame::*;

double secant(const std::vector<KeyFrame>& keys, std::size_t k, Values value) {
  return (keys[k + 1].*value - keys[k].*value) / (keys[k + 1].at_s - keys[k].at_s);
}

/// Slope at key k: the weighted harmonic mean of its neighbours' secants, 0 at a turn.
double slope(const std::vector<KeyFrame>& keys, std::size_t k, Values value) {
  if (k == 0) return secant(keys, 0, value);
  if (k + 1 == keys.size()) return secant(keys, k - 1, value);
  const double before = secant(keys, k - 1, value), after = secant(keys, k, value);
  if (before * after <= 0) return 0;
  const double h0 = keys[k].at_s - keys[k - 1].at_s, h1 = keys[k + 1].at_s - keys[k].at_s;
  const double w0 = 2 * h1 + h0, w1 = h1 + 2 * h0;
  return (w0 + w1) / (w0 / before + w1 / after);
}

double hermite(const std::vector<KeyFrame>& keys, std::size_t k, double at_s, Values value) {
  const double a = keys[k].*value, b = keys[k + 1].*value;
  if (a == b) return a;
  const double h = keys[k + 1].at_s - keys[k].at_s, s = (at_s - keys[k].at_s) / h;
  const double s2 = s * s, s3 = s2 * s;
  return a * (2 * s3 - 3 * s2 + 1) + b * (3 * s2 - 2 * s3) +
         h * (slope(keys, k, value) * (s3 - 2 * s2 + s) + slope(keys, k + 1, value) * (s3 - s2));
}

}  // namespace

KeyFrame path_at(const std::vector<KeyFrame>& keys, double at_s) {
  check(!keys.empty(), "a path has a key frame");
  if (at_s <= keys.front().at_s) return keys.front();
  if (at_s >= keys.back().at_s) return keys.back();
  const auto after =
      std::upper_bound(keys.begin(), keys.end(), at_s, [](double t, const KeyFrame& k) { return t < k.at_s; });
  const auto k = static_cast<std::size_t>(after - keys.begin()) - 1;
  const auto at = [&](Values value) { return hermite(keys, k, at_s, value); };
  return {at_s, at(&KeyFrame::time_s), at(&KeyFrame::azimuth_deg), at(&KeyFrame::elevation_deg)};
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
