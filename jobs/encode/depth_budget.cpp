#include "jobs/encode/depth_budget.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace vantage {
namespace {

constexpr double kTooMuch = 0.001;  ///< of the pixels
constexpr double kCutOff = 0.1;     ///< of a border

bool leaves_budget(const FrameDisparity& d) { return d.too_near_share + d.too_far_share > kTooMuch; }
bool is_cut_off(const FrameDisparity& d) { return std::max(d.cut_left_share, d.cut_right_share) > kCutOff; }

/// "3-7, 12": rising frame numbers, runs shortened, at most six runs.
std::string runs_of(const std::vector<int>& frames) {
  std::vector<std::string> runs;
  for (std::size_t k = 0; k < frames.size();) {
    std::size_t last = k;
    while (last + 1 < frames.size() && frames[last + 1] == frames[last] + 1) ++last;
    if (runs.size() == 6) {
      runs.emplace_back("…");
      break;
    }
    runs.push_back(last > k ? fmt::format("{}-{}", frames[k], frames[last]) : fmt::format("{}", frames[k]));
    k = last + 1;
  }
  return fmt::format("{}", fmt::join(runs, ", "));
}

struct Range {
  double nearest = 0, farthest = 0;  ///< % of the width
};
Range range_of(const std::vector<BudgetFrame>& frames) {
  Range range{frames.front().disparity.p0_1_percent, frames.front().disparity.p99_9_percent};
  for (const BudgetFrame& f : frames) {
    range.nearest = std::min(range.nearest, f.disparity.p0_1_percent);
    range.farthest = std::max(range.farthest, f.disparity.p99_9_percent);
  }
  return range;
}

/// What brings a film into its budget.
std::string advice(const Range& range, const DepthBudget& budget) {
  const double room = budget.crossed_percent + budget.uncrossed_percent, depth = range.farthest - range.nearest;
  const double gain = std::min(1.0, room / depth);
  std::string text;
  if (gain < 1) text = fmt::format("take {:.2g} times the baseline", gain);
  const double move = gain * range.nearest < -budget.crossed_percent ? -budget.crossed_percent - gain * range.nearest
                      : gain * range.farthest > budget.uncrossed_percent
                          ? budget.uncrossed_percent - gain * range.farthest
                          : 0;
  if (move != 0)
    text += fmt::format("{}{} convergence", text.empty() ? "" : " and ", move > 0 ? "a nearer" : "a farther");
  return text + ", or mode = \"stereo-depth\" with disparity_map = \"log\"";
}

/// Where things are in the chart.
struct Chart {
  static constexpr int kLeft = 70, kTop = 30, kWidth = 900, kHeight = 300;
  double low, high;  ///< % of the width, shown from top to bottom
  std::size_t num;

  int x(std::size_t frame) const { return kLeft + static_cast<int>(frame * kWidth / std::max<std::size_t>(num, 1)); }
  int y(double percent) const {
    return kTop + static_cast<int>(std::lround((std::clamp(percent, low, high) - low) / (high - low) * kHeight));
  }
  cv::Rect bar(std::size_t frame, double from, double to) const {
    return {cv::Point(x(frame), y(from)), cv::Point(std::max(x(frame) + 1, x(frame + 1)), y(to) + 1)};
  }
};

void write_text(cv::Mat3b& picture, const std::string& text, cv::Point at) {
  cv::putText(picture, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.42, cv::Scalar(60, 60, 60), 1, cv::LINE_AA);
}

void draw_scale(cv::Mat3b& picture, const Chart& chart) {
  const double depth = chart.high - chart.low, step = depth > 20 ? 5 : depth > 8 ? 2 : depth > 3 ? 1 : 0.5;
  for (double percent = std::ceil(chart.low / step) * step; percent <= chart.high; percent += step) {
    const int y = chart.y(percent);
    const bool screen = std::abs(percent) < 1e-9;
    cv::line(picture, {Chart::kLeft, y}, {Chart::kLeft + Chart::kWidth, y},
             screen ? cv::Scalar(90, 90, 90) : cv::Scalar(222, 222, 222), 1);
    write_text(picture, screen ? "screen" : fmt::format("{:+.3g} %", percent), {8, y + 4});
  }
}

}  // namespace

Json depth_budget_table(const std::vector<BudgetFrame>& frames, const DepthBudget& budget) {
  Json rows = Json::array();
  std::size_t num_outside = 0, num_cut = 0;
  for (const BudgetFrame& f : frames) {
    Json row = to_json(f.disparity);
    row["frame"] = f.frame;
    rows.push_back(std::move(row));
    num_outside += leaves_budget(f.disparity);
    num_cut += is_cut_off(f.disparity);
  }
  const Range range = range_of(frames);
  return {{"crossed_percent", budget.crossed_percent},
          {"uncrossed_percent", budget.uncrossed_percent},
          {"nearest_percent", range.nearest},
          {"farthest_percent", range.farthest},
          {"frames_outside_budget", num_outside},
          {"frames_cut_off", num_cut},
          {"frames", rows}};
}

cv::Mat3b depth_budget_chart(const std::vector<BudgetFrame>& frames, const DepthBudget& budget) {
  const Range range = range_of(frames);
  const double low = std::min(range.nearest, -budget.crossed_percent),
               high = std::max(range.farthest, budget.uncrossed_percent);
  const Chart chart{low - 0.08 * (high - low), high + 0.08 * (high - low), frames.size()};
  cv::Mat3b picture(Chart::kTop + Chart::kHeight + 40, Chart::kLeft + Chart::kWidth + 20, cv::Vec3b(255, 255, 255));
  cv::rectangle(picture,
                chart.bar(0, -budget.crossed_percent, budget.uncrossed_percent) |
                    chart.bar(frames.size() - 1, -budget.crossed_percent, budget.uncrossed_percent),
                cv::Scalar(226, 244, 226), cv::FILLED);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const FrameDisparity& d = frames[k].disparity;
    const bool bad = leaves_budget(d);
    const cv::Scalar light = bad ? cv::Scalar(190, 190, 245) : cv::Scalar(235, 210, 180);
    const cv::Scalar dark = bad ? cv::Scalar(110, 110, 225) : cv::Scalar(200, 150, 90);
    cv::rectangle(picture, chart.bar(k, d.p0_1_percent, d.p99_9_percent), light, cv::FILLED);
    cv::rectangle(picture, chart.bar(k, d.p5_percent, d.p95_percent), dark, cv::FILLED);
    cv::rectangle(picture, chart.bar(k, d.p50_percent, d.p50_percent), cv::Scalar(40, 40, 40), cv::FILLED);
  }
  draw_scale(picture, chart);
  for (const double limit : {-budget.crossed_percent, budget.uncrossed_percent})
    cv::line(picture, {Chart::kLeft, chart.y(limit)}, {Chart::kLeft + Chart::kWidth, chart.y(limit)},
             cv::Scalar(60, 150, 60), 2);
  write_text(picture, "disparity, % of the width: in front of the screen at the top; green: limits of the depth budget",
             {Chart::kLeft, 18});
  write_text(picture, fmt::format("frame {}", frames.front().frame), {Chart::kLeft, Chart::kTop + Chart::kHeight + 20});
  write_text(picture, fmt::format("{}", frames.back().frame),
             {Chart::kLeft + Chart::kWidth - 30, Chart::kTop + Chart::kHeight + 20});
  return picture;
}

std::vector<std::string> depth_budget_warnings(const std::vector<BudgetFrame>& frames, const DepthBudget& budget) {
  std::vector<int> outside, cut;
  double cut_percent = 0;
  for (const BudgetFrame& f : frames) {
    if (leaves_budget(f.disparity)) outside.push_back(f.frame);
    if (!is_cut_off(f.disparity)) continue;
    cut.push_back(f.frame);
    cut_percent = std::max(cut_percent, f.disparity.cut_percent);
  }
  std::vector<std::string> warnings;
  const Range range = range_of(frames);
  if (!outside.empty())
    warnings.push_back(fmt::format(
        "{} of {} frames ({}) leave the depth budget: disparity from {:.2f} to {:+.2f} % of the width, comfortable are "
        "-{:.3g} to +{:.3g} %: {}",
        outside.size(), frames.size(), runs_of(outside), range.nearest, range.farthest, budget.crossed_percent,
        budget.uncrossed_percent, advice(range, budget)));
  if (!cut.empty())
    warnings.push_back(
        fmt::format("{} of {} frames ({}) show things in front of the screen that the picture's left or "
                    "right border cuts off: floating_window_percent = {:.1f} or a nearer convergence",
                    cut.size(), frames.size(), runs_of(cut), std::min(10.0, cut_percent + 0.05)));
  return warnings;
}

}  // namespace vantage
