#include "jobs/sync/pair_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace vantage::sync {
namespace {

constexpr int kWidthPerCamera = 640;
constexpr double kTailS = 0.4;
constexpr std::size_t kMaxDrawn = 80;

cv::Scalar colour_of(std::size_t k) {
  const double hue = std::fmod(0.61803398875 * static_cast<double>(k), 1.0);  // neighbours in the list far apart
  cv::Mat3b one(1, 1, cv::Vec3b(static_cast<uchar>(180 * hue), 200, 255));
  cv::cvtColor(one, one, cv::COLOR_HSV2BGR);
  return {static_cast<double>(one(0, 0)[0]), static_cast<double>(one(0, 0)[1]), static_cast<double>(one(0, 0)[2])};
}

std::size_t nearest_frame(const FrameTable& table, double time_s) {
  std::size_t best = 0;
  for (std::size_t k = 0; k < table.pts_s.size(); ++k)
    if (std::abs(table.pts_s[k] - time_s) < std::abs(table.pts_s[best] - time_s)) best = k;
  return best;
}

struct Moment {
  double time_a_s = 0, time_b_s = 0;
  std::size_t frame_a = 0, frame_b = 0;
};

/// a's frame at which most pairs are seen by both.
std::optional<Moment> busiest(const MotionInput& in, const MotionAnswer& answer) {
  Moment best;
  std::size_t most = 0;
  for (std::size_t f = 0; f < in.table_a.pts_s.size(); ++f) {
    const double time_a = in.table_a.pts_s[f], time_b = (time_a - answer.fit->offset_s) / answer.fit->rate;
    const auto num = static_cast<std::size_t>(std::count_if(answer.points.begin(), answer.points.end(),
                                                            [&](auto& p) { return p.a.at(time_a) && p.b.at(time_b); }));
    if (num > most) most = num, best = {time_a, time_b, f, nearest_frame(in.table_b, time_b)};
  }
  return most > 0 ? std::optional(best) : std::nullopt;
}

cv::Mat canvas(const cv::Mat1b& grey, double scale) {
  cv::Mat out;
  cv::cvtColor(grey * 0.6, out, cv::COLOR_GRAY2BGR);
  cv::resize(out, out, {}, scale, scale, cv::INTER_AREA);
  return out;
}

/// The path up to time_s; where it is then.
std::optional<cv::Point> draw_path(cv::Mat& picture, const TimedTrack& track, double time_s, double scale,
                                   const cv::Scalar& colour) {
  const auto pixel = [&](const Eigen::Vector2d& px) {
    return cv::Point(cvRound(px.x() * scale), cvRound(px.y() * scale));
  };
  const auto here = track.at(time_s);
  if (!here) return std::nullopt;
  std::vector<cv::Point> path;
  for (std::size_t k = 0; k < track.size(); ++k)
    if (track.time_s(k) <= time_s && track.time_s(k) >= time_s - kTailS) path.push_back(pixel(track.px(k)));
  path.push_back(pixel(*here));
  cv::polylines(picture, path, false, colour, 1, cv::LINE_AA);
  cv::circle(picture, path.back(), 3, colour, cv::FILLED, cv::LINE_AA);
  return path.back();
}

/// Signed distances of all samples that both cameras have.
std::vector<double> residuals_px(const std::vector<PathPair>& pairs, const PairGeometry& geometry,
                                 const OffsetFit& fit) {
  std::vector<double> out;
  for (const PathPair& pair : pairs)
    for (std::size_t k = 0; k < pair.a.size(); ++k) {
      const double time_b = (pair.a.time_s(k) - fit.offset_s) / fit.rate;
      const auto px_b = pair.b.at(time_b);
      if (!px_b) continue;
      if (const auto r = geometry.residual_px(pair.a.px(k), pair.a.time_s(k), *px_b, time_b)) out.push_back(*r);
    }
  return out;
}

constexpr int kBins = 61, kBarPx = 8, kHeight = 180, kMarginPx = 24;

/// One panel: from -max_px to max_px, what lies beyond in the outermost bars.
cv::Mat histogram(const std::vector<double>& values_px, double max_px, const std::string& title) {
  std::vector<int> counts(kBins, 0);
  for (const double v : values_px)
    ++counts[static_cast<std::size_t>(std::clamp((v / max_px + 1) / 2, 0.0, 1.0) * (kBins - 1) + 0.5)];
  const int highest = std::max(1, *std::max_element(counts.begin(), counts.end()));
  cv::Mat picture(kHeight, kBins * kBarPx + 2 * kMarginPx, CV_8UC3, cv::Scalar::all(255));
  const int floor_y = kHeight - kMarginPx;
  for (int k = 0; k < kBins; ++k) {
    const int top = floor_y - counts[static_cast<std::size_t>(k)] * (kHeight - 3 * kMarginPx) / highest;
    cv::rectangle(picture, {kMarginPx + k * kBarPx, top}, {kMarginPx + (k + 1) * kBarPx - 2, floor_y},
                  k == kBins / 2 ? cv::Scalar(92, 157, 42) : cv::Scalar(160, 120, 80), cv::FILLED);
  }
  const auto text = [&](const std::string& words, cv::Point at) {
    cv::putText(picture, words, at, cv::FONT_HERSHEY_SIMPLEX, 0.4, cv::Scalar::all(40), 1, cv::LINE_AA);
  };
  text(title, {kMarginPx, 16});
  text(fmt::format("{:.0f} px", -max_px), {6, kHeight - 8});
  text("0", {kMarginPx + kBins * kBarPx / 2 - 4, kHeight - 8});
  text(fmt::format("{:.0f} px", max_px), {kMarginPx + kBins * kBarPx - 24, kHeight - 8});
  return picture;
}

double middle_size(std::vector<double> values) {
  for (double& v : values) v = std::abs(v);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

cv::Mat matches_picture(const MotionInput& in, const MotionAnswer& answer) {
  const auto moment = answer.fit ? busiest(in, answer) : std::nullopt;
  if (!moment) return {};
  const cv::Mat1b grey_a = in.grey_a(static_cast<int>(moment->frame_a)),
                  grey_b = in.grey_b(static_cast<int>(moment->frame_b));
  const double scale_a = static_cast<double>(kWidthPerCamera) / grey_a.cols,
               scale_b = static_cast<double>(kWidthPerCamera) / grey_b.cols;
  cv::Mat a = canvas(grey_a, scale_a), b = canvas(grey_b, scale_b);
  std::vector<std::pair<cv::Point, cv::Point>> ends;
  std::vector<cv::Scalar> colours;
  for (std::size_t k = 0; k < answer.points.size() && ends.size() < kMaxDrawn; ++k) {
    if (!answer.points[k].a.at(moment->time_a_s) || !answer.points[k].b.at(moment->time_b_s)) continue;
    colours.push_back(colour_of(k));
    ends.emplace_back(*draw_path(a, answer.points[k].a, moment->time_a_s, scale_a, colours.back()),
                      *draw_path(b, answer.points[k].b, moment->time_b_s, scale_b, colours.back()));
  }
  cv::Mat both(std::max(a.rows, b.rows), a.cols + b.cols, CV_8UC3, cv::Scalar::all(0));
  a.copyTo(both({0, 0, a.cols, a.rows}));
  b.copyTo(both({a.cols, 0, b.cols, b.rows}));
  for (std::size_t k = 0; k < ends.size(); ++k)
    cv::line(both, ends[k].first, ends[k].second + cv::Point(a.cols, 0), colours[k] * 0.7, 1, cv::LINE_AA);
  return both;
}

cv::Mat residuals_picture(const MotionInput& in, const MotionAnswer& answer) {
  if (!answer.fit || !in.geometry) return {};
  std::vector<cv::Mat> panels;
  const auto add = [&](const std::vector<PathPair>& pairs, const std::string& what) {
    const auto values = residuals_px(pairs, *in.geometry, *answer.fit);
    if (values.empty()) return;
    const double middle_px = middle_size(values);
    panels.push_back(histogram(
        values, std::max(2.0, std::ceil(6 * middle_px)),
        fmt::format("{}: {} samples off their epipolar lines by {:.2f} px (median)", what, values.size(), middle_px)));
  };
  add(answer.points, "points");
  add(answer.outlines.pairs, "outlines");
  cv::Mat picture;
  if (!panels.empty()) cv::vconcat(panels, picture);
  return picture;
}

}  // namespace vantage::sync
