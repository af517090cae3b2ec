#include "jobs/correspond/plane_refine.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "jobs/vision/vector_clones.h"

namespace vantage {
namespace {

constexpr int kRadius_px = 4;
/// Grey levels by which two good matches differ: noise of both pictures and of interpolation.
constexpr float kNoise = 4;
/// A neighbour this far off the centre's plane counts a quarter, px along the line.
constexpr float kSurface_px = 0.7F;
/// Uncertainty of the inverse depths given, px: it weighs the neighbours where grey values say nothing.
constexpr float kPrior_px = 1.0F;

/// Per pixel, in px along the line (inverse depth times `px_per_inverse_depth` of the whole picture).
struct Steps {
  cv::Mat1f at, target, weight, slope_x, slope_y;
};

cv::Mat1f detail(const cv::Mat1b& grey, double sigma_px) {
  cv::Mat1f sharp, coarse;
  grey.convertTo(sharp, CV_32F);
  cv::GaussianBlur(sharp, coarse, {}, 6 * std::max(1.0, sigma_px));
  if (sigma_px > 0) cv::GaussianBlur(sharp, sharp, {}, sigma_px);
  cv::subtract(sharp, coarse, sharp);
  return sharp;
}

struct Gradient {
  cv::Mat1f x, y;
};

Gradient gradient_of(const cv::Mat1f& picture) {
  const cv::Mat1f derivative = (cv::Mat1f(1, 5) << 1 / 12.0F, -8 / 12.0F, 0, 8 / 12.0F, -1 / 12.0F);
  Gradient g;
  cv::filter2D(picture, g.x, CV_32F, derivative, {-1, -1}, 0, cv::BORDER_REPLICATE);
  cv::filter2D(picture, g.y, CV_32F, derivative.t(), {-1, -1}, 0, cv::BORDER_REPLICATE);
  return g;
}

/// Where each pixel goes (array indices of b), and how that moves per px along the line.
struct Lines {
  cv::Mat2f end, direction;
};

Lines lines_of(const ShiftedView& views, const cv::Mat1f& inverse_depth, const cv::Mat1f& aside_px,
               double px_per_unit) {
  Lines lines{cv::Mat2f(inverse_depth.size()), cv::Mat2f(inverse_depth.size())};
  for (int y = 0; y < inverse_depth.rows; ++y)
    for (int x = 0; x < inverse_depth.cols; ++x) {
      const LinePoint line = views.line_at({x + 0.5, y + 0.5}, inverse_depth(y, x));
      const Eigen::Vector2d end = line.end + aside_px(y, x) * line.across;
      lines.end(y, x) = {static_cast<float>(end.x() - 0.5), static_cast<float>(end.y() - 0.5)};
      lines.direction(y, x) = {static_cast<float>(line.per_inverse_depth.x() / px_per_unit),
                               static_cast<float>(line.per_inverse_depth.y() / px_per_unit)};
    }
  return lines;
}

/// Slope of the surface at each pixel: of the differences to either side the smaller, which does not cross an edge.
cv::Mat1f slope_of(const cv::Mat1f& at, cv::Point along) {
  constexpr int kReach = 3;
  cv::Mat1f slope(at.size());
  for (int y = 0; y < at.rows; ++y)
    for (int x = 0; x < at.cols; ++x) {
      const auto value = [&](int k) {
        return at(std::clamp(y + k * along.y, 0, at.rows - 1), std::clamp(x + k * along.x, 0, at.cols - 1));
      };
      const float after = value(kReach) - value(0), before = value(0) - value(-kReach);
      slope(y, x) = (std::abs(after) < std::abs(before) ? after : before) / kReach;
    }
  return slope;
}

Steps newton_steps(const cv::Mat1f& a, const cv::Mat1f& b, const Lines& lines, const cv::Mat1f& at,
                   const cv::Mat1b& known) {
  const Gradient ga = gradient_of(a), gb = gradient_of(b);
  cv::Mat1f there, there_x, there_y;
  cv::remap(b, there, lines.end, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  cv::remap(gb.x, there_x, lines.end, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::remap(gb.y, there_y, lines.end, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  Steps s{at, cv::Mat1f(at.size()), cv::Mat1f(at.size()), slope_of(at, {1, 0}), slope_of(at, {0, 1})};
  const float right = static_cast<float>(b.cols) - 0.5F, bottom = static_cast<float>(b.rows) - 0.5F;
  for (int y = 0; y < at.rows; ++y)
    for (int x = 0; x < at.cols; ++x) {
      const cv::Vec2f end = lines.end(y, x), along = lines.direction(y, x);
      const bool usable = known(y, x) && end[0] > -0.5F && end[1] > -0.5F && end[0] < right && end[1] < bottom;
      const float rest = there(y, x) - a(y, x);
      const float slope = along[0] * there_x(y, x) + along[1] * there_y(y, x);
      const float doubt = 1 + rest * rest / (9 * kNoise * kNoise);
      const float information = slope * slope / (kNoise * kNoise * doubt * doubt);
      const float prior = (along[0] * along[0] + along[1] * along[1]) / (kPrior_px * kPrior_px);
      const float sum = information + prior;
      s.target(y, x) =
          at(y, x) - (std::abs(slope) > 1e-6F ? information / sum * std::clamp(rest / slope, -1.5F, 1.5F) : 0);
      s.weight(y, x) = usable ? sum : (known(y, x) ? prior : 0);
    }
  return s;
}

/// Sums for the planes of one row: 6 of the matrix, 3 of the right side, each `width` long.
using RowSums = std::vector<float>;

/// Adds the neighbours at (dx, dy) of pixels x0 to x1 of a row; rows are pointed at their first pixel.
VANTAGE_VECTOR_CLONES void add_neighbours(const float* at, const float* slope_x, const float* slope_y,
                                          const float* their_at, const float* their_target, const float* their_weight,
                                          float dx, float dy, float nearness, int count, float* sums, int stride) {
  for (int x = 0; x < count; ++x) {
    const float off = (their_at[x] - at[x] - slope_x[x] * dx - slope_y[x] * dy) * (1 / kSurface_px);
    const float same = 1 / (1 + off * off);
    const float w = nearness * same * same * their_weight[x];
    const float t = w * (their_target[x] - at[x]);
    sums[x] += w;
    sums[stride + x] += w * dx;
    sums[2 * stride + x] += w * dy;
    sums[3 * stride + x] += w * (dx * dx);
    sums[4 * stride + x] += w * (dx * dy);
    sums[5 * stride + x] += w * (dy * dy);
    sums[6 * stride + x] += t;
    sums[7 * stride + x] += t * dx;
    sums[8 * stride + x] += t * dy;
  }
}

/// Value at the centre of the plane that fits best; a little is added to the diagonal so that too few neighbours give
/// their mean.
VANTAGE_VECTOR_CLONES void solve_planes(const float* sums, int stride, int count, const float* at, float* out) {
  for (int x = 0; x < count; ++x) {
    const float w = sums[x], wx = sums[stride + x], wy = sums[2 * stride + x];
    const float wxx = sums[3 * stride + x] + 0.02F * w, wxy = sums[4 * stride + x],
                wyy = sums[5 * stride + x] + 0.02F * w;
    const float t = sums[6 * stride + x], tx = sums[7 * stride + x], ty = sums[8 * stride + x];
    const float c0 = wxx * wyy - wxy * wxy, c1 = wxy * wy - wx * wyy, c2 = wx * wxy - wxx * wy;
    const float determinant = w * c0 + wx * c1 + wy * c2;
    const float step = determinant > 1e-12F ? (t * c0 + tx * c1 + ty * c2) / determinant : 0;
    out[x] = at[x] + std::min(std::max(step, -1.5F), 1.5F);
  }
}

cv::Mat1f fitted(const Steps& s) {
  const int w = s.at.cols, h = s.at.rows;
  cv::Mat1f out(s.at.size());
  RowSums sums;
  for (int y = 0; y < h; ++y) {
    sums.assign(9 * static_cast<std::size_t>(w), 0.0F);
    for (int dy = -kRadius_px; dy <= kRadius_px; ++dy) {
      if (y + dy < 0 || y + dy >= h) continue;
      for (int dx = -kRadius_px; dx <= kRadius_px; ++dx) {
        if ((dx + dy) & 1) continue;  // every other pixel is as good as all
        const float nearness = std::exp(-static_cast<float>(dx * dx + dy * dy) / (0.5F * kRadius_px * kRadius_px));
        const int first = std::max(0, -dx), last = std::min(w, w - dx);
        add_neighbours(s.at[y] + first, s.slope_x[y] + first, s.slope_y[y] + first, s.at[y + dy] + first + dx,
                       s.target[y + dy] + first + dx, s.weight[y + dy] + first + dx, static_cast<float>(dx),
                       static_cast<float>(dy), nearness, last - first, sums.data() + first, w);
      }
    }
    solve_planes(sums.data(), w, w, s.at[y], out[y]);
  }
  return out;
}

}  // namespace

void refine_on_planes(const cv::Mat1b& a, const cv::Mat1b& b, const ShiftedView& views, const cv::Mat1f& aside_px,
                      const cv::Mat1b& known, const PlaneRefineOptions& options, cv::Mat1f& inverse_depth) {
  const double px_per_unit = views.typical_px_per_inverse_depth(inverse_depth, known);
  if (px_per_unit <= 0) return;
  for (int k = 0; k < options.iterations; ++k) {
    const double sigma_px = k == 0 ? options.reach_px : k == 1 ? 0.5 * options.reach_px : 0.0;
    cv::Mat1f at;
    inverse_depth.convertTo(at, CV_32F, px_per_unit);
    const Lines lines = lines_of(views, inverse_depth, aside_px, px_per_unit);
    const Steps steps = newton_steps(detail(a, sigma_px), detail(b, sigma_px), lines, at, known);
    cv::Mat1f better = fitted(steps);
    better.convertTo(better, CV_32F, 1 / px_per_unit);
    better.copyTo(inverse_depth, known);
  }
}

}  // namespace vantage
