#include "jobs/correspond/settle_flow.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "jobs/correspond/plane_refine.h"

namespace vantage {
namespace {

/// Matches of still things scatter by 0.05 px across their lines, 0.1 where the views differ much; the mean over
/// kAround_px squared is known better than that. What lies farther aside than this on the mean moved.
constexpr float kMoved_px = 0.15F;
constexpr int kAround_px = 7;
/// A match that lies farther from the mean of its surroundings is not averaged: two things move there.
constexpr float kAlike_px = 0.5F;

struct OnLines {
  cv::Mat1f inverse_depth, aside_px;
  cv::Mat1b known;
};

OnLines nearest_on_lines(const ShiftedView& views, const cv::Mat2f& motion, const cv::Mat1b& known) {
  OnLines on{cv::Mat1f(motion.size(), 0.0F), cv::Mat1f(motion.size(), 0.0F), known.clone()};
  for (int y = 0; y < motion.rows; ++y)
    for (int x = 0; x < motion.cols; ++x) {
      if (!known(y, x)) continue;
      const Eigen::Vector2d px(x + 0.5, y + 0.5), end = px + Eigen::Vector2d(motion(y, x)[0], motion(y, x)[1]);
      if (const auto fit = fit_inverse_depth(views.views, px, end)) {
        const LinePoint line = views.line_at(px, fit->inverse_depth);
        on.inverse_depth(y, x) = static_cast<float>(fit->inverse_depth);
        on.aside_px(y, x) = static_cast<float>((end - line.end).dot(line.across));
      } else {
        on.known(y, x) = 0;
      }
    }
  return on;
}

/// Mean over the known pixels around.
cv::Mat1f local_mean(const cv::Mat1f& values, const cv::Mat1b& known) {
  cv::Mat1f weights, sums = values.clone();
  known.convertTo(weights, CV_32F, 1.0 / 255);
  sums.setTo(0, known == 0);
  cv::boxFilter(weights, weights, CV_32F, {kAround_px, kAround_px});
  cv::boxFilter(sums, sums, CV_32F, {kAround_px, kAround_px});
  cv::max(weights, 1e-3F, weights);
  cv::divide(sums, weights, sums);
  return sums;
}

/// How far beside the lines things are that moved: 0 on what did not, the mean where all around moves alike.
cv::Mat1f steady_aside(const OnLines& on) {
  cv::Mat1f aside = local_mean(on.aside_px, on.known);
  for (int y = 0; y < aside.rows; ++y)
    for (int x = 0; x < aside.cols; ++x)
      if (float& mean = aside(y, x); std::abs(on.aside_px(y, x) - mean) > kAlike_px)
        mean = on.aside_px(y, x);
      else if (std::abs(mean) < kMoved_px)
        mean = 0;
  return aside;
}

/// `known`: not 0 where a match comes back.
cv::Mat2f settled(const PosedPicture& a, const PosedPicture& b, const cv::Mat1b& known, const cv::Mat2f& motion) {
  const ShiftedView views = fit_shift({a.pinhole, a.cam_from_world, b.pinhole, b.cam_from_world}, motion, known);
  OnLines on = nearest_on_lines(views, motion, known);
  const cv::Mat1f aside = steady_aside(on);
  refine_on_planes(a.grey, b.grey, views, aside, on.known, {.iterations = 3, .reach_px = 0.5}, on.inverse_depth);
  cv::Mat2f better = motion.clone();
  for (int y = 0; y < motion.rows; ++y)
    for (int x = 0; x < motion.cols; ++x) {
      if (!on.known(y, x)) continue;
      const Eigen::Vector2d px(x + 0.5, y + 0.5);
      const LinePoint line = views.line_at(px, on.inverse_depth(y, x));
      const Eigen::Vector2d m = line.end + aside(y, x) * line.across - px;
      better(y, x) = {static_cast<float>(m.x()), static_cast<float>(m.y())};
    }
  return better;
}

}  // namespace

void settle_on_lines(const PosedPicture& a, const PosedPicture& b, float consistent_px, FlowPair& flow) {
  const cv::Mat known_a = round_trip_px(flow.a_to_b, flow.b_to_a) < consistent_px,
                known_b = round_trip_px(flow.b_to_a, flow.a_to_b) < consistent_px;
  flow.a_to_b = settled(a, b, known_a, flow.a_to_b);
  flow.b_to_a = settled(b, a, known_b, flow.b_to_a);
}

}  // namespace vantage
