#include "jobs/calibrate/colour_samples.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <utility>

#include "jobs/vision/epipolar.h"
#include "schema/formats/colour.h"

namespace vantage {
namespace {

constexpr int kWorkingSidePx = 1280;  // colours need no fine detail
constexpr int kMaxFeatures = 3000;
constexpr double kMaxRatio = 0.8, kMaxSizeRatio = 1.6;
constexpr double kMaxDescriptorDistance = 300;  // of 512, the length of a descriptor
constexpr double kMaxEpipolarPx = 2;
constexpr std::size_t kNearest = 3;
/// Levels between which a camera's curve is a power law: black is noise, near white channels clip one by one.
constexpr int kDarkestLevel = 20, kBrightestLevel = 245;

/// A picture at working size with its features and their colours.
struct Described {
  const PosedColourPicture* source = nullptr;
  Pinhole pinhole;
  std::vector<cv::KeyPoint> points;
  cv::Mat descriptors;
  std::vector<std::optional<Eigen::Vector3d>> linear;  ///< by point; empty when its region may not be compared
};

Eigen::Vector2d pixel_of(const cv::KeyPoint& point) { return {point.pt.x + 0.5, point.pt.y + 0.5}; }

std::optional<Eigen::Vector3d> mean_linear(const cv::Mat3b& bgr, const cv::KeyPoint& point) {
  static const auto linear_of = [] {
    std::array<double, 256> table{};
    for (std::size_t level = 0; level < table.size(); ++level)
      table[level] = linear_of_level(static_cast<double>(level));
    return table;
  }();
  const int half = std::clamp(cvRound(point.size / 2), 1, 15), x = cvRound(point.pt.x), y = cvRound(point.pt.y);
  const cv::Rect region(x - half, y - half, 2 * half + 1, 2 * half + 1);
  if ((region & cv::Rect({}, bgr.size())) != region) return std::nullopt;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int row = region.y; row < region.y + region.height; ++row)
    for (int column = region.x; column < region.x + region.width; ++column)
      for (int c = 0; c < 3; ++c) {
        const uchar level = bgr(row, column)[2 - c];
        if (level < kDarkestLevel || level > kBrightestLevel) return std::nullopt;
        sum[c] += linear_of[level];
      }
  return sum / region.area();
}

Described describe(const PosedColourPicture& picture) {
  Described out{.source = &picture, .pinhole = picture.pinhole, .points = {}, .descriptors = {}, .linear = {}};
  const double scale =
      std::min(1.0, static_cast<double>(kWorkingSidePx) / std::max(picture.bgr.cols, picture.bgr.rows));
  cv::Mat3b bgr;
  cv::Mat1b grey, counts;
  cv::resize(picture.bgr, bgr, {}, scale, scale, cv::INTER_AREA);
  if (!picture.counts.empty()) cv::resize(picture.counts, counts, bgr.size(), 0, 0, cv::INTER_NEAREST);
  const double sx = static_cast<double>(bgr.cols) / picture.bgr.cols,
               sy = static_cast<double>(bgr.rows) / picture.bgr.rows;
  const Pinhole& p = picture.pinhole;
  out.pinhole = {bgr.cols, bgr.rows, p.fx * sx, p.fy * sy, p.cx * sx, p.cy * sy};
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  cv::SIFT::create(kMaxFeatures)->detectAndCompute(grey, counts, out.points, out.descriptors);
  for (const auto& point : out.points) out.linear.push_back(mean_linear(bgr, point));
  return out;
}

double size_ratio(const cv::KeyPoint& a, const cv::KeyPoint& b) {
  return std::max(a.size, b.size) / std::max(1e-3F, std::min(a.size, b.size));
}

/// Best of `to` for each of `from` among those on its epipolar line and of about its size; -1 where there is none, or
/// the second best is as good.
std::vector<int> best_matches(const Described& from, const Described& to) {
  const TwoView views(from.pinhole, from.source->cam_from_world, to.pinhole, to.source->cam_from_world);
  std::vector<int> best(from.points.size(), -1);
  for (std::size_t i = 0; i < from.points.size(); ++i) {
    const Eigen::Vector3d line = views.homogeneous(pixel_of(from.points[i]), 0).cross(views.e);
    const double length = line.head<2>().norm();
    double first = kMaxDescriptorDistance, second = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < to.points.size(); ++j) {
      const double off = std::abs(line.dot(pixel_of(to.points[j]).homogeneous()));
      if (off > kMaxEpipolarPx * length || size_ratio(from.points[i], to.points[j]) > kMaxSizeRatio) continue;
      const double distance =
          cv::norm(from.descriptors.row(static_cast<int>(i)), to.descriptors.row(static_cast<int>(j)));
      if (distance < first) {
        second = std::exchange(first, distance);
        best[i] = static_cast<int>(j);
      } else {
        second = std::min(second, distance);
      }
    }
    if (first > kMaxRatio * second) best[i] = -1;
  }
  return best;
}

void add_samples(const Described& a, const Described& b, std::vector<ColourSample>& samples) {
  const auto forward = best_matches(a, b), backward = best_matches(b, a);
  const TwoView views(a.pinhole, a.source->cam_from_world, b.pinhole, b.source->cam_from_world);
  for (std::size_t i = 0; i < forward.size(); ++i) {
    if (forward[i] < 0 || backward[static_cast<std::size_t>(forward[i])] != static_cast<int>(i)) continue;
    const auto j = static_cast<std::size_t>(forward[i]);
    const auto fit = fit_inverse_depth(views, pixel_of(a.points[i]), pixel_of(b.points[j]));
    if (!fit || fit->inverse_depth <= 0 || !a.linear[i] || !b.linear[j]) continue;
    samples.push_back({a.source->camera, b.source->camera, *a.linear[i], *b.linear[j]});
  }
}

/// Each picture with those of other cameras that look in the most similar direction.
std::set<std::pair<std::size_t, std::size_t>> neighbours(const std::vector<PosedColourPicture>& pictures) {
  std::set<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    std::vector<std::pair<double, std::size_t>> others;
    for (std::size_t j = 0; j < pictures.size(); ++j)
      if (pictures[j].camera != pictures[i].camera)
        others.emplace_back(-pictures[i].cam_from_world.R.row(2).dot(pictures[j].cam_from_world.R.row(2)), j);
    std::ranges::sort(others);
    for (std::size_t k = 0; k < std::min(kNearest, others.size()); ++k) pairs.insert(std::minmax(i, others[k].second));
  }
  return pairs;
}

}  // namespace

std::vector<ColourSample> colour_samples(const std::vector<PosedColourPicture>& pictures) {
  std::vector<Described> described;
  for (const auto& picture : pictures) described.push_back(describe(picture));
  std::vector<ColourSample> samples;
  for (const auto& [i, j] : neighbours(pictures)) add_samples(described[i], described[j], samples);
  return samples;
}

}  // namespace vantage
