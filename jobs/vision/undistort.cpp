#include "jobs/vision/undistort.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "schema/base/error.h"

namespace vantage {
namespace {

/// All lens models as the largest of them, OpenCV's rational one.
struct Rational {
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0, k4 = 0, k5 = 0, k6 = 0;

  bool is_pinhole() const {
    return std::ranges::all_of(std::array{k1, k2, p1, p2, k3, k4, k5, k6}, [](double k) { return k == 0.0; });
  }
  /// Ratio of filmed to true distance from the optical axis, tangential part aside.
  double radial(double r2) const {
    return (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)));
  }
  cv::Point2d project(const cv::Point2d& n) const {
    const double r2 = n.x * n.x + n.y * n.y, s = radial(r2);
    const double x = n.x * s + 2 * p1 * n.x * n.y + p2 * (r2 + 2 * n.x * n.x);
    const double y = n.y * s + 2 * p2 * n.x * n.y + p1 * (r2 + 2 * n.y * n.y);
    return {fx * x + cx, fy * y + cy};
  }
  /// False where the polynomial flattens out, soon to turn back on itself: there a pixel would be stretched more than
  /// four times, and further out it would show what no lens shows.
  bool rises_up_to(double radius) const {
    constexpr int kSteps = 32;
    const double delta = 1e-6 * radius;
    const auto filmed_radius = [&](double r) { return r * radial(r * r); };
    for (int i = 1; i <= kSteps; ++i) {
      const double r = radius * i / kSteps;
      if (!(filmed_radius(r) - filmed_radius(r - delta) > delta / 4)) return false;
    }
    return true;
  }
};

Rational rational_of(const LensModel& lens) {
  const auto& p = lens.params;
  const auto with_one_focal = [&](double k1, double k2) {
    return Rational{.fx = p.at(0), .fy = p.at(0), .cx = p.at(1), .cy = p.at(2), .k1 = k1, .k2 = k2};
  };
  if (lens.model == "SIMPLE_PINHOLE") return with_one_focal(0, 0);
  if (lens.model == "SIMPLE_RADIAL") return with_one_focal(p.at(3), 0);
  if (lens.model == "RADIAL") return with_one_focal(p.at(3), p.at(4));
  Rational out{.fx = p.at(0), .fy = p.at(1), .cx = p.at(2), .cy = p.at(3)};
  if (lens.model == "PINHOLE") return out;
  out.k1 = p.at(4), out.k2 = p.at(5), out.p1 = p.at(6), out.p2 = p.at(7);
  if (lens.model == "OPENCV") return out;
  check(lens.model == "FULL_OPENCV", "readers only let known lens models in: " + lens.model);
  out.k3 = p.at(8), out.k4 = p.at(9), out.k5 = p.at(10), out.k6 = p.at(11);
  return out;
}

Pinhole scaled_pinhole(const LensModel& lens, const Rational& r, double zoom) {
  return {lens.width, lens.height, r.fx * zoom, r.fy * zoom, r.cx, r.cy};
}

/// Whether every pixel on the rim of the pinhole's picture was filmed.
bool rim_was_filmed(const LensModel& lens, const Rational& r, const Pinhole& pinhole) {
  constexpr int kPointsPerSide = 64;
  const double w = lens.width, h = lens.height;
  const auto filmed = [&](double x, double y) {
    const cv::Point2d n((x - pinhole.cx) / pinhole.fx, (y - pinhole.cy) / pinhole.fy), px = r.project(n);
    return px.x >= 0 && px.x <= w && px.y >= 0 && px.y <= h && r.rises_up_to(std::hypot(n.x, n.y));
  };
  for (int i = 0; i <= kPointsPerSide; ++i) {
    const double x = w * i / kPointsPerSide, y = h * i / kPointsPerSide;
    if (!filmed(x, 0) || !filmed(x, h) || !filmed(0, y) || !filmed(w, y)) return false;
  }
  return true;
}

bool same_pixels(const LensModel& lens, const Rational& r, const Pinhole& p) {
  return r.is_pinhole() && lens.width == p.width && lens.height == p.height && r.fx == p.fx && r.fy == p.fy &&
         r.cx == p.cx && r.cy == p.cy;
}

/// Array index to read for a continuous coordinate. The outer half of the rim's pixels belongs to the picture, too.
float array_index(double continuous, int size) {
  const double index = continuous - 0.5;
  if (index < -0.5 || index > size - 0.5 || std::isnan(index)) return -2.0F;
  return static_cast<float>(std::clamp(index, 0.0, size - 1.0));
}

}  // namespace

Pinhole undistorted_pinhole(const LensModel& lens) {
  const Rational r = rational_of(lens);
  if (r.is_pinhole()) return scaled_pinhole(lens, r, 1);
  // The widest view with a full picture. Below 1/2 the middle of the picture would lose too much detail.
  double too_wide = 0.5, fits = 0.5;
  if (rim_was_filmed(lens, r, scaled_pinhole(lens, r, fits))) return scaled_pinhole(lens, r, fits);
  while (fits < 8 && !rim_was_filmed(lens, r, scaled_pinhole(lens, r, fits)))
    too_wide = std::exchange(fits, fits * 1.25);
  for (int i = 0; i < 40; ++i) {
    const double middle = (too_wide + fits) / 2;
    (rim_was_filmed(lens, r, scaled_pinhole(lens, r, middle)) ? fits : too_wide) = middle;
  }
  return scaled_pinhole(lens, r, fits);
}

Undistorter::Undistorter(const CameraModel& camera) {
  if (!camera.filmed) return;
  const LensModel& lens = *camera.filmed;
  const Pinhole& p = camera.pinhole;
  const Rational r = rational_of(lens);
  if (same_pixels(lens, r, p)) return;
  map_x_.create(p.height, p.width, CV_32F);
  map_y_.create(p.height, p.width, CV_32F);
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x) {
      const cv::Point2d px = r.project({(x + 0.5 - p.cx) / p.fx, (y + 0.5 - p.cy) / p.fy});
      map_x_.at<float>(y, x) = array_index(px.x, lens.width);
      map_y_.at<float>(y, x) = array_index(px.y, lens.height);
    }
}

cv::Mat Undistorter::apply(const cv::Mat& bgr) const {
  if (is_identity()) return bgr;
  cv::Mat out;
  cv::remap(bgr, out, map_x_, map_y_, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  return out;
}

cv::Mat1b Undistorter::apply_mask(const cv::Mat1b& mask) const {
  const cv::Mat counts = apply(mask) > 127;
  return counts;
}

cv::Point2d distort(const LensModel& lens, const cv::Point2d& normalised) {
  return rational_of(lens).project(normalised);
}

}  // namespace vantage
