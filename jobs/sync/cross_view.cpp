#include "jobs/sync/cross_view.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/video/tracking.hpp>

namespace vantage::sync {
namespace {

constexpr int kMaxFrames = 30;
constexpr int kPyramidLevels = 1;
constexpr float kMaxForwardBackwardPx = 0.5F;
constexpr float kMaxCorrectionPx = 12;
constexpr double kMaxUnsteadinessPx = 0.7;
constexpr std::size_t kMinFound = 3;
/// Window side: big enough to be sure, small enough to stay on one surface.
constexpr double kWindowPerWidth = 1.0 / 34;

struct Correction {
  double time_b_s = 0;
  Eigen::Vector2d px;
};

int nearest_frame(const FrameTable& table, double time_s) {
  const auto after = std::lower_bound(table.pts_s.begin(), table.pts_s.end(), time_s);
  auto k = after - table.pts_s.begin();
  if (k == std::ssize(table.pts_s) ||
      (k > 0 && time_s - table.pts_s[static_cast<std::size_t>(k) - 1] < *after - time_s))
    --k;
  return static_cast<int>(k);
}

bool covers(const TimedTrack& track, int frame) {
  return frame >= track.first_frame && frame < track.first_frame + static_cast<int>(track.size());
}

cv::Point2f point_at(const TimedTrack& track, int frame) {
  const Eigen::Vector2d& px = track.px(static_cast<std::size_t>(frame - track.first_frame));
  return {static_cast<float>(px.x() - 0.5), static_cast<float>(px.y() - 0.5)};
}

/// Frames of b to look at: spread over the time that both cameras share.
std::vector<int> frames_to_search(const FrameTable& table_a, const FrameTable& table_b, double offset_s) {
  std::vector<int> shared;
  for (int frame = 0; frame < table_b.num_frames(); ++frame) {
    const double time_a = table_b.pts_s[static_cast<std::size_t>(frame)] + offset_s;
    if (time_a >= table_a.pts_s.front() && time_a <= table_a.pts_s.back()) shared.push_back(frame);
  }
  const int num = std::min<int>(kMaxFrames, static_cast<int>(shared.size()));
  std::vector<int> chosen;
  for (int k = 0; k < num; ++k)
    chosen.push_back(shared[static_cast<std::size_t>(k) * shared.size() / static_cast<std::size_t>(num)]);
  return chosen;
}

/// The picture in the top left corner of a larger one: pyramids can only be compared that are of one size.
cv::Mat1b padded(const cv::Mat1b& picture, const cv::Size& size) {
  if (picture.size() == size) return picture;
  cv::Mat1b out;
  cv::copyMakeBorder(picture, out, 0, size.height - picture.rows, 0, size.width - picture.cols, cv::BORDER_REPLICATE);
  return out;
}

/// Adds what one pair of pictures says of every match that has its point in both.
void search_frame(const cv::Mat1b& picture_a, const cv::Mat1b& picture_b, const std::vector<TimedTrack>& a,
                  const std::vector<TimedTrack>& b, const std::vector<TrackMatch>& matches, int frame_a, int frame_b,
                  double time_b_s, std::vector<std::vector<Correction>>& corrections) {
  std::vector<std::size_t> which;
  std::vector<cv::Point2f> from, to, back;
  for (std::size_t m = 0; m < matches.size(); ++m) {
    if (!covers(a[matches[m].a], frame_a) || !covers(b[matches[m].b], frame_b)) continue;
    which.push_back(m);
    from.push_back(point_at(a[matches[m].a], frame_a));
    to.push_back(point_at(b[matches[m].b], frame_b));
  }
  if (which.empty()) return;
  const std::vector<cv::Point2f> start = to;
  const int side = std::max(11, static_cast<int>(picture_a.cols * kWindowPerWidth)) | 1;
  const cv::TermCriteria stop(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 0.005);
  std::vector<uchar> ok, ok_back;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(picture_a, picture_b, from, to, ok, error, {side, side}, kPyramidLevels, stop,
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  back = from;
  cv::calcOpticalFlowPyrLK(picture_b, picture_a, to, back, ok_back, error, {side, side}, kPyramidLevels, stop,
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  for (std::size_t i = 0; i < which.size(); ++i) {
    const cv::Point2f moved = to[i] - start[i], returned = back[i] - from[i];
    if (!ok[i] || !ok_back[i] || cv::norm(returned) > kMaxForwardBackwardPx || cv::norm(moved) > kMaxCorrectionPx)
      continue;
    corrections[which[i]].push_back({time_b_s, {moved.x, moved.y}});
  }
}

/// Straight line through the corrections that lie near their median; empty when they are few or unsteady.
std::optional<TimedTrack> corrected(const TimedTrack& track, std::vector<Correction> found) {
  if (found.size() < kMinFound) return std::nullopt;
  const auto median_of = [&](int axis) {
    std::vector<double> values;
    for (const auto& c : found) values.push_back(c.px[axis]);
    std::nth_element(values.begin(), values.begin() + std::ssize(values) / 2, values.end());
    return values[values.size() / 2];
  };
  const Eigen::Vector2d middle(median_of(0), median_of(1));
  const std::size_t num_found = found.size();
  std::erase_if(found, [&](const Correction& c) { return (c.px - middle).norm() > 3 * kMaxUnsteadinessPx; });
  if (found.size() < kMinFound || 3 * found.size() < 2 * num_found) return std::nullopt;

  double mean_t = 0, var_t = 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero(), covariance = Eigen::Vector2d::Zero();
  for (const auto& c : found)
    mean_t += c.time_b_s / static_cast<double>(found.size()), mean += c.px / static_cast<double>(found.size());
  for (const auto& c : found) {
    var_t += (c.time_b_s - mean_t) * (c.time_b_s - mean_t);
    covariance += (c.time_b_s - mean_t) * (c.px - mean);
  }
  const Eigen::Vector2d slope = var_t > 0 ? Eigen::Vector2d(covariance / var_t) : Eigen::Vector2d(0, 0);
  const auto line = [&](double t) -> Eigen::Vector2d { return mean + slope * (t - mean_t); };
  double unsteadiness = 0;
  for (const auto& c : found) unsteadiness += (c.px - line(c.time_b_s)).norm() / static_cast<double>(found.size());
  if (unsteadiness > kMaxUnsteadinessPx) return std::nullopt;

  std::vector<double> times;
  std::vector<Eigen::Vector2d> px;
  for (std::size_t k = 0; k < track.size(); ++k) {
    times.push_back(track.time_s(k));
    px.push_back(track.px(k) + line(track.time_s(k)));
  }
  TimedTrack out(std::move(times), std::move(px));
  out.first_frame = track.first_frame;
  out.index = track.index;
  return out;
}

}  // namespace

std::vector<PathPair> refine_matches(const std::vector<TimedTrack>& a, const std::vector<TimedTrack>& b,
                                     const std::vector<TrackMatch>& matches, const FrameTable& table_a,
                                     const FrameTable& table_b, const GreyFrames& grey_a, const GreyFrames& grey_b,
                                     double offset_s) {
  std::vector<std::vector<Correction>> corrections(matches.size());
  for (const int frame_b : frames_to_search(table_a, table_b, offset_s)) {
    const double time_b = table_b.pts_s[static_cast<std::size_t>(frame_b)];
    const int frame_a = nearest_frame(table_a, time_b + offset_s);
    const cv::Mat1b picture_a = grey_a(frame_a), picture_b = grey_b(frame_b);
    const cv::Size size(std::max(picture_a.cols, picture_b.cols), std::max(picture_a.rows, picture_b.rows));
    search_frame(padded(picture_a, size), padded(picture_b, size), a, b, matches, frame_a, frame_b, time_b,
                 corrections);
  }
  std::vector<PathPair> pairs;
  for (std::size_t m = 0; m < matches.size(); ++m)
    if (auto path = corrected(b[matches[m].b], std::move(corrections[m])))
      pairs.push_back({a[matches[m].a], std::move(*path)});
  return pairs;
}

}  // namespace vantage::sync
