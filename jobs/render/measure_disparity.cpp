#include "jobs/render/measure_disparity.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace vantage {
namespace {

/// Less than a pixel of an HD picture is no violation.
constexpr double kSlack_percent = 0.05;
/// The border of a picture, of its width.
constexpr double kBorder = 0.005;

/// Goes through the known pixels of pictures; all disparities in % of the width, negative in front.
class Measurement {
 public:
  Measurement(const StereoPlan& plan, const DisparityCurve& curve)
      : plan_(plan), curve_(curve), histogram_(plan.mapping.width_px) {}

  void add(const ViewPicture& picture) {
    for (int y = 0; y < picture.z.rows; ++y)
      for (int x = 0; x < picture.z.cols; ++x) {
        if (!(picture.z(y, x) > 0)) continue;
        const double percent = percent_of(picture.z(y, x));
        histogram_.add(-percent / 100 * plan_.mapping.width_px, 1);
        nearest_ = num_ == 0 ? percent : std::min(nearest_, percent);
        farthest_ = num_ == 0 ? percent : std::max(farthest_, percent);
        ++num_;
        num_too_near_ += percent < -plan_.mapping.budget.crossed_percent - kSlack_percent;
        num_too_far_ += percent > plan_.mapping.budget.uncrossed_percent + kSlack_percent;
      }
  }

  /// Share of a strip's known pixels in front of the window; how far they are goes to `cuts`.
  double cut_share(const ViewPicture& picture, const cv::Range& columns, std::vector<double>& cuts) const {
    std::size_t num = 0, before = cuts.size();
    for (int y = 0; y < picture.z.rows; ++y)
      for (int x = columns.start; x < columns.end; ++x) {
        if (!(picture.z(y, x) > 0)) continue;
        ++num;
        const double percent = -percent_of(picture.z(y, x));
        if (percent > plan_.floating_window_percent + kSlack_percent) cuts.push_back(percent);
      }
    return num > 0 ? static_cast<double>(cuts.size() - before) / static_cast<double>(num) : 0;
  }

  FrameDisparity result() const {
    FrameDisparity d;
    if (num_ == 0) return d;
    d.nearest_percent = nearest_;
    d.farthest_percent = farthest_;
    d.p0_1_percent = percentile(0.001);
    d.p5_percent = percentile(0.05);
    d.p50_percent = percentile(0.5);
    d.p95_percent = percentile(0.95);
    d.p99_9_percent = percentile(0.999);
    d.too_near_share = static_cast<double>(num_too_near_) / static_cast<double>(num_);
    d.too_far_share = static_cast<double>(num_too_far_) / static_cast<double>(num_);
    return d;
  }

 private:
  double percent_of(float z) const {
    return -100 * curve_(plan_.rig.disparity_px(static_cast<double>(z))) / plan_.mapping.width_px;
  }
  double percentile(double share) const {
    return std::clamp(-100 * histogram_.quantile(1 - share) / plan_.mapping.width_px, nearest_, farthest_);
  }

  const StereoPlan& plan_;
  const DisparityCurve& curve_;
  DisparityHistogram histogram_;
  double nearest_ = 0, farthest_ = 0;
  std::size_t num_ = 0, num_too_near_ = 0, num_too_far_ = 0;
};

}  // namespace

FrameDisparity measure_disparity(const ViewPicture& left, const ViewPicture& right, const StereoPlan& plan,
                                 const DisparityCurve& curve) {
  Measurement measurement(plan, curve);
  measurement.add(left);
  measurement.add(right);
  FrameDisparity d = measurement.result();
  std::vector<double> cuts;
  const int width = left.z.cols, border = std::max(1, static_cast<int>(std::lround(kBorder * width)));
  const int bar = static_cast<int>(std::lround(plan.floating_window_percent / 100 * width));
  d.cut_left_share = measurement.cut_share(left, {std::min(bar, width), std::min(bar + border, width)}, cuts);
  d.cut_right_share = measurement.cut_share(right, {std::max(0, width - bar - border), width - bar}, cuts);
  if (cuts.empty()) return d;
  const auto most = cuts.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(cuts.size() - 1));
  std::nth_element(cuts.begin(), most, cuts.end());
  d.cut_percent = *most;
  return d;
}

void draw_floating_window(ViewPicture& left, ViewPicture& right, const StereoPlan& plan) {
  const int width = left.z.cols, bar = static_cast<int>(std::lround(plan.floating_window_percent / 100 * width));
  const auto black_out = [](ViewPicture& picture, const cv::Range& columns) {
    if (columns.size() <= 0) return;
    picture.bgr.colRange(columns).setTo(cv::Scalar::all(0));
    picture.alpha.colRange(columns).setTo(1);
    picture.z.colRange(columns).setTo(0);
    picture.hole.colRange(columns).setTo(0);
  };
  black_out(left, {0, bar});
  black_out(right, {width - bar, width});
}

}  // namespace vantage
