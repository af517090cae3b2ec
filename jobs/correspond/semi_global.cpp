#include "jobs/correspond/semi_global.h"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "jobs/vision/vector_clones.h"

namespace vantage {
namespace {

// In differing census bits. Slanted floors take single steps all the time, so kSmallJump is low.
constexpr int kSmallJump = 5;
constexpr int kLargeJump = 60;
constexpr int kLargeJumpLeast = 14;
constexpr std::int16_t kFar = 8000;

/// Sum over paths of the least cost to reach a label; 8 paths of at most 62 + 60 fit 16 bits.
using Sums = std::vector<std::int16_t>;

/// One path's costs at one pixel, with a kFar label before the first and after the last.
struct Front {
  std::vector<std::int16_t> costs;
  std::int16_t least = 0;
  explicit Front(int num_labels) : costs(static_cast<std::size_t>(num_labels) + 2, 0) { reset(); }
  void reset() {
    std::fill(costs.begin(), costs.end(), std::int16_t{0});
    costs.front() = costs.back() = kFar;
    least = 0;
  }
};

/// L(p, d) = C(p, d) + min(L(q, d), L(q, d±1) + P1, min L(q) + P2) - min L(q); returns min L(p). before and after are
/// shifted by the kFar label.
VANTAGE_VECTOR_CLONES std::int16_t advance(const std::uint8_t* cost, const std::int16_t* before,
                                           std::int16_t least_before, std::int16_t large_jump, int num_labels,
                                           std::int16_t* after, std::int16_t* sum) {
  const auto jump = static_cast<std::int16_t>(least_before + large_jump);
  std::int16_t least = kFar;
  for (int d = 0; d < num_labels; ++d) {
    const std::int16_t side = std::min(before[d], before[d + 2]);
    std::int16_t m = std::min(before[d + 1], static_cast<std::int16_t>(side + kSmallJump));
    m = std::min(m, jump);
    const auto value = static_cast<std::int16_t>(cost[d] + m - least_before);
    after[d + 1] = value;
    sum[d] = static_cast<std::int16_t>(sum[d] + value);
    least = std::min(least, value);
  }
  return least;
}

std::int16_t large_jump(const cv::Mat1b& guide, int x, int y, int from_x, int from_y) {
  const int edge = std::abs(guide(y, x) - guide(from_y, from_x));
  return static_cast<std::int16_t>(std::max(kLargeJumpLeast, kLargeJump * 8 / (8 + edge)));
}

/// The four paths that come from above and from the left (step +1), or from below and from the right (step -1).
void sweep_four_paths(const CostVolume& volume, const cv::Mat1b& guide, int step, Sums& sums) {
  const int w = volume.width, h = volume.height, n = volume.num_labels;
  using Row = std::vector<Front>;
  std::array<Row, 3> above{Row(static_cast<std::size_t>(w), Front(n)), Row(static_cast<std::size_t>(w), Front(n)),
                           Row(static_cast<std::size_t>(w), Front(n))};
  std::array<Row, 3> here = above;
  Front left(n), next_left(n);
  const Front start(n);
  for (int row = 0; row < h; ++row) {
    const int y = step > 0 ? row : h - 1 - row;
    left.reset();
    for (int column = 0; column < w; ++column) {
      const int x = step > 0 ? column : w - 1 - column;
      const std::uint8_t* cost = volume.at(x, y);
      std::int16_t* sum = sums.data() + volume.offset(x, y);
      const int left_x = column > 0 ? x - step : x;
      next_left.least = advance(cost, left.costs.data(), left.least, large_jump(guide, x, y, left_x, y), n,
                                next_left.costs.data(), sum);
      std::swap(left, next_left);
      for (int path = 0; path < 3; ++path) {
        const int from_x = x + path - 1, from_y = y - step;
        const bool inside = row > 0 && from_x >= 0 && from_x < w;
        const Front& before = inside ? above[static_cast<std::size_t>(path)][static_cast<std::size_t>(from_x)] : start;
        Front& after = here[static_cast<std::size_t>(path)][static_cast<std::size_t>(x)];
        const std::int16_t jump =
            inside ? large_jump(guide, x, y, from_x, from_y) : static_cast<std::int16_t>(kLargeJump);
        after.least = advance(cost, before.costs.data(), before.least, jump, n, after.costs.data(), sum);
      }
    }
    std::swap(above, here);
  }
}

float best_label(const std::int16_t* sums, int num_labels) {
  const int best = static_cast<int>(std::min_element(sums, sums + num_labels) - sums);
  if (best == 0 || best == num_labels - 1) return static_cast<float>(best);
  const int below = sums[best - 1] - sums[best], over = sums[best + 1] - sums[best];
  const int bend = below + over;
  return static_cast<float>(best) +
         (bend > 0 ? 0.5F * static_cast<float>(below - over) / static_cast<float>(bend) : 0.0F);
}

}  // namespace

cv::Mat1f semi_global_labels(const CostVolume& volume, const cv::Mat1b& guide) {
  Sums sums(volume.size(), 0);
  sweep_four_paths(volume, guide, +1, sums);
  sweep_four_paths(volume, guide, -1, sums);
  cv::Mat1f labels(volume.height, volume.width);
  for (int y = 0; y < volume.height; ++y)
    for (int x = 0; x < volume.width; ++x)
      labels(y, x) = best_label(sums.data() + volume.offset(x, y), volume.num_labels);
  return labels;
}

}  // namespace vantage
