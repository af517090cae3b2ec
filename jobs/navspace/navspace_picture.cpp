#include "jobs/navspace/navspace_picture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace vantage {
namespace {

constexpr int kWidth = 480, kMargin = 14;

/// Places vertices by two of their coordinates into a box.
class Panel {
 public:
  Panel(const Navspace& navspace, double NavVertex::*x, double NavVertex::*y, double y_sign, cv::Rect box)
      : x_(x), y_(y), y_sign_(y_sign), box_(box) {
    for (const NavVertex& v : navspace.vertices) {
      low_ = {std::min(low_.x, v.*x_), std::min(low_.y, y_sign_ * (v.*y_))};
      high_ = {std::max(high_.x, v.*x_), std::max(high_.y, y_sign_ * (v.*y_))};
    }
  }

  cv::Point place(const NavVertex& v) const {
    const auto share = [](double value, double low, double high) {
      return high > low ? (value - low) / (high - low) : 0.5;
    };
    return {box_.x + static_cast<int>(std::lround(share(v.*x_, low_.x, high_.x) * (box_.width - 1))),
            box_.y + static_cast<int>(std::lround(share(y_sign_ * (v.*y_), low_.y, high_.y) * (box_.height - 1)))};
  }

 private:
  double NavVertex::*x_;
  double NavVertex::*y_;
  double y_sign_;
  cv::Rect box_;
  cv::Point2d low_{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  cv::Point2d high_{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
};

void draw(cv::Mat3b& picture, const Navspace& navspace, const Panel& panel) {
  const auto at = [&](int v) { return panel.place(navspace.vertices[static_cast<std::size_t>(v)]); };
  for (const auto& [i, k] : navspace.edges) cv::line(picture, at(i), at(k), {190, 160, 120}, 1, cv::LINE_AA);
  for (const NavVertex& v : navspace.vertices)
    cv::circle(picture, panel.place(v), 2, {60, 60, 200}, cv::FILLED, cv::LINE_AA);
}

}  // namespace

cv::Mat navspace_picture(const Navspace& navspace) {
  cv::Mat3b picture(360, kWidth, cv::Vec3b(255, 255, 255));
  const int inner = kWidth - 2 * kMargin;
  draw(picture, navspace,
       Panel(navspace, &NavVertex::azimuth_deg, &NavVertex::elevation_deg, -1, {kMargin, kMargin, inner, 110}));
  draw(picture, navspace,
       Panel(navspace, &NavVertex::azimuth_deg, &NavVertex::time_s, 1, {kMargin, 124 + 2 * kMargin, inner, 194}));
  return picture;
}

}  // namespace vantage
