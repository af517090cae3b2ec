#include "jobs/render/resample.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace vantage {
namespace {

using Four = float __attribute__((vector_size(16)));

/// Weights of the four samples around a place, t after the second.
struct Cubic {
  float w[4];
};
Cubic catmull_rom(float t) {
  const float t2 = t * t, t3 = t2 * t;
  return {{-0.5F * t3 + t2 - 0.5F * t, 1.5F * t3 - 2.5F * t2 + 1, -1.5F * t3 + 2 * t2 + 0.5F * t, 0.5F * (t3 - t2)}};
}

/// Largest whole number up to value.
int whole(float value) {
  const int truncated = static_cast<int>(value);
  return truncated - (value < static_cast<float>(truncated) ? 1 : 0);
}

/// Blue, green, red and whatever comes next, which nobody looks at; there must be such a float.
Four load(const cv::Vec3f* pixel) {
  Four four;
  std::memcpy(&four, pixel, sizeof four);
  return four;
}

Four least(Four a, Four b) { return a < b ? a : b; }
Four most(Four a, Four b) { return a < b ? b : a; }

/// rows: four pixels each.
Four weigh(const std::array<const cv::Vec3f*, 4>& rows, const Cubic& wx, const Cubic& wy) {
  std::array<Four, 4> line{};
  Four low{}, high{};
  for (std::size_t v = 0; v < 4; ++v) {
    const Four p1 = load(rows[v] + 1), p2 = load(rows[v] + 2);
    line[v] = load(rows[v]) * wx.w[0] + p1 * wx.w[1] + p2 * wx.w[2] + load(rows[v] + 3) * wx.w[3];
    if (v == 1) low = least(p1, p2), high = most(p1, p2);
    if (v == 2) low = least(low, least(p1, p2)), high = most(high, most(p1, p2));
  }
  const Four sum = line[0] * wy.w[0] + line[1] * wy.w[1] + line[2] * wy.w[2] + line[3] * wy.w[3];
  const Four margin = (high - low) * 0.1F;
  return least(most(sum, low - margin), high + margin);
}

cv::Vec3f colour(Four four) { return {four[0], four[1], four[2]}; }

}  // namespace

cv::Vec3f resample(const cv::Mat3f& picture, const cv::Vec2f& px) {
  const float fx = px[0] - 0.5F, fy = px[1] - 0.5F;
  const int left = whole(fx), top = whole(fy), x0 = left - 1, y0 = top - 1;
  const Cubic wx = catmull_rom(fx - static_cast<float>(left)), wy = catmull_rom(fy - static_cast<float>(top));
  std::array<const cv::Vec3f*, 4> rows{};
  if (x0 >= 0 && y0 >= 0 && x0 + 4 < picture.cols && y0 + 3 < picture.rows) {
    for (int v = 0; v < 4; ++v) rows[static_cast<std::size_t>(v)] = picture[y0 + v] + x0;
    return colour(weigh(rows, wx, wy));
  }
  float rim[4][15];  // five pixels of each row
  for (int v = 0; v < 4; ++v) {
    const cv::Vec3f* row = picture[std::clamp(y0 + v, 0, picture.rows - 1)];
    for (int u = 0; u < 5; ++u)
      std::memcpy(rim[v] + 3 * u, row[std::clamp(x0 + u, 0, picture.cols - 1)].val, 3 * sizeof(float));
    rows[static_cast<std::size_t>(v)] = reinterpret_cast<const cv::Vec3f*>(rim[v]);
  }
  return colour(weigh(rows, wx, wy));
}

}  // namespace vantage
