#include "jobs/correspond/stereo_flow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "jobs/correspond/plane_sweep.h"

namespace vantage {
namespace {

/// Width of the pictures in which the range of depths is found.
constexpr int kRangeWidth = 200;
/// Matches that come back this close are consistent, px of the matched size.
constexpr float kConsistent_px = 1.5F;

PosedPicture resized(const PosedPicture& full, double scale) {
  PosedPicture small = full;
  const cv::Size size(std::max(16, cvRound(full.grey.cols * scale)), std::max(16, cvRound(full.grey.rows * scale)));
  if (size == full.grey.size()) return small;
  cv::resize(full.grey, small.grey, size, 0, 0, cv::INTER_AREA);
  const double sx = static_cast<double>(size.width) / full.grey.cols,
               sy = static_cast<double>(size.height) / full.grey.rows;
  small.pinhole = {size.width,           size.height,          full.pinhole.fx * sx,
                   full.pinhole.fy * sy, full.pinhole.cx * sx, full.pinhole.cy * sy};
  return small;
}

cv::Mat2f motion_of(const cv::Mat1f& inverse_depth, const TwoView& views) {
  cv::Mat2f motion(inverse_depth.size());
  for (int y = 0; y < motion.rows; ++y)
    for (int x = 0; x < motion.cols; ++x) {
      const Eigen::Vector2d px(x + 0.5, y + 0.5);
      const auto end = views.project(px, inverse_depth(y, x));
      const Eigen::Vector2d m = end ? Eigen::Vector2d(*end - px) : Eigen::Vector2d(1e4, 1e4);
      motion(y, x) = {static_cast<float>(m.x()), static_cast<float>(m.y())};
    }
  return motion;
}

/// Second smallest of the nearest known values in 8 directions: an occluded pixel belongs to what lies farther away
/// (Hirschmüller 2008, §2.6). Values are known where mask is not 0.
void fill_from_background(cv::Mat1f& inverse_depth, const cv::Mat1b& known) {
  constexpr float kNone = 1e30F;
  const int w = known.cols, h = known.rows;
  std::array<cv::Mat1f, 8> nearest;
  for (auto& field : nearest) field = cv::Mat1f(known.size(), kNone);
  const std::array<cv::Point, 4> kForward{cv::Point(-1, 0), cv::Point(-1, -1), cv::Point(0, -1), cv::Point(1, -1)};
  for (int pass = 0; pass < 2; ++pass)
    for (int k = 0; k < w * h; ++k) {
      const int index = pass == 0 ? k : w * h - 1 - k, x = index % w, y = index / w;
      for (std::size_t d = 0; d < 4; ++d) {
        const cv::Point from = pass == 0 ? cv::Point(x, y) + kForward[d] : cv::Point(x, y) - kForward[d];
        cv::Mat1f& field = nearest[d + (pass == 0 ? 0 : 4)];
        if (known(y, x))
          field(y, x) = inverse_depth(y, x);
        else if (from.x >= 0 && from.y >= 0 && from.x < w && from.y < h)
          field(y, x) = field(from);
      }
    }
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      if (known(y, x)) continue;
      std::array<float, 8> seen;
      for (std::size_t d = 0; d < 8; ++d) seen[d] = nearest[d](y, x);
      std::sort(seen.begin(), seen.end());
      if (seen[1] < kNone)
        inverse_depth(y, x) = seen[1];
      else if (seen[0] < kNone)
        inverse_depth(y, x) = seen[0];
    }
}

struct BothWays {
  TwoView ab, ba;
  cv::Mat1f inverse_depth_a, inverse_depth_b;
  cv::Mat1b known_a, known_b;
};

BothWays match(const PosedPicture& a, const PosedPicture& b, const Sweep& sweep_a, const Sweep& sweep_b) {
  BothWays m{
      two_views(a, b), two_views(b, a), sweep_inverse_depth(a, b, sweep_a), sweep_inverse_depth(b, a, sweep_b), {}, {}};
  const cv::Mat2f ab = motion_of(m.inverse_depth_a, m.ab), ba = motion_of(m.inverse_depth_b, m.ba);
  m.known_a = round_trip_px(ab, ba) < kConsistent_px;
  m.known_b = round_trip_px(ba, ab) < kConsistent_px;
  return m;
}

/// The consistent matches' inverse depths, a few of the outermost left aside, and a tenth more on each side.
std::pair<double, double> range_of(const cv::Mat1f& inverse_depth, const cv::Mat1b& known, const Sweep& whole) {
  std::vector<float> values;
  for (int y = 0; y < known.rows; ++y)
    for (int x = 0; x < known.cols; ++x)
      if (known(y, x)) values.push_back(inverse_depth(y, x));
  if (values.size() < 50) return {whole.first, whole.last()};
  const auto at = [&](double share) {
    const auto k = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), k, values.end());
    return static_cast<double>(*k);
  };
  const double low = at(0.003), high = at(0.997), margin = 0.1 * (high - low) + 2 * whole.step;
  return {std::max(whole.first, low - margin), high + margin};
}

}  // namespace

bool stereo_flow(const PosedPicture& a, const PosedPicture& b, const StereoOptions& options, FlowPair& flow) {
  const double range_scale = std::min(1.0, static_cast<double>(kRangeWidth) / a.grey.cols);
  const PosedPicture range_a = resized(a, range_scale), range_b = resized(b, range_scale);
  const Sweep wide_a = widest_sweep({range_a.pinhole, a.cam_from_world, range_b.pinhole, b.cam_from_world},
                                    range_a.grey.size(), options.max_labels);
  const Sweep wide_b = widest_sweep({range_b.pinhole, b.cam_from_world, range_a.pinhole, a.cam_from_world},
                                    range_b.grey.size(), options.max_labels);
  if (wide_a.count == 0 || wide_b.count == 0) return false;
  const BothWays coarse = match(range_a, range_b, wide_a, wide_b);
  const auto [low_a, high_a] = range_of(coarse.inverse_depth_a, coarse.known_a, wide_a);
  const auto [low_b, high_b] = range_of(coarse.inverse_depth_b, coarse.known_b, wide_b);

  double scale = 1;
  while (static_cast<double>(a.grey.total()) * scale * scale > options.max_pixels) scale /= 2;
  const PosedPicture small_a = resized(a, scale), small_b = resized(b, scale);
  const TwoView ab(small_a.pinhole, a.cam_from_world, small_b.pinhole, b.cam_from_world),
      ba(small_b.pinhole, b.cam_from_world, small_a.pinhole, a.cam_from_world);
  BothWays fine = match(small_a, small_b, sweep_between(ab, small_a.grey.size(), low_a, high_a, options.max_labels),
                        sweep_between(ba, small_b.grey.size(), low_b, high_b, options.max_labels));
  fill_from_background(fine.inverse_depth_a, fine.known_a);
  fill_from_background(fine.inverse_depth_b, fine.known_b);
  cv::medianBlur(fine.inverse_depth_a, fine.inverse_depth_a, 3);
  cv::medianBlur(fine.inverse_depth_b, fine.inverse_depth_b, 3);
  cv::resize(fine.inverse_depth_a, fine.inverse_depth_a, a.grey.size(), 0, 0, cv::INTER_NEAREST);
  cv::resize(fine.inverse_depth_b, fine.inverse_depth_b, b.grey.size(), 0, 0, cv::INTER_NEAREST);
  flow.a_to_b = motion_of(fine.inverse_depth_a, {a.pinhole, a.cam_from_world, b.pinhole, b.cam_from_world});
  flow.b_to_a = motion_of(fine.inverse_depth_b, {b.pinhole, b.cam_from_world, a.pinhole, a.cam_from_world});
  return true;
}

}  // namespace vantage
