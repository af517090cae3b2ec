#include "jobs/track/follow.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace vantage::track {
namespace {

/// OpenCV puts the centre of the first pixel at 0, we at 0.5.
constexpr float kCentre = 0.5F;
constexpr double kCornerQuality = 0.01;
constexpr int kCornerBlock = 5, kCornerMargin = 8;
constexpr int kPyramidLevels = 3;
/// Neighbouring tracks of a moving thing: near enough for some on small things, far enough to be worth having.
constexpr double kMovingSpacingPx = 4;
constexpr double kMaxHomographyErrorPx = 1.5;

struct LiveTrack {
  int first_frame = 0;
  std::vector<cv::Point2f> px;        // integer centres
  std::vector<cv::Point2f> residual;  // path left after the background's motion, summed up
  bool in_moving_region = false;      // where it was found
};

class Follower {
 public:
  Follower(const FollowOptions& options, std::optional<cv::Mat1b> plate)
      : options_(options), regions_(std::move(plate)) {}

  void add_frame(int frame, const cv::Mat1b& grey, const cv::Mat1b& counts) {
    cv::Mat homography;
    std::vector<cv::Mat> pyramid;
    const cv::Size window(options_.window_px, options_.window_px);
    cv::buildOpticalFlowPyramid(grey, pyramid, window, kPyramidLevels);
    if (!grey_.empty() && !live_.empty()) homography = step(pyramid, grey.size(), counts);
    const cv::Mat1b moving = regions_.mask(grey, grey_, homography);
    find_corners(frame, grey, moving, counts);
    grey_ = grey;
    pyramid_ = std::move(pyramid);
  }
  std::vector<Track> finish() {
    for (auto& track : live_) retire(std::move(track));
    live_.clear();
    std::stable_sort(done_.begin(), done_.end(),
                     [](const Track& a, const Track& b) { return a.first_frame < b.first_frame; });
    return std::move(done_);
  }

 private:
  /// Follows all live tracks into the picture of a pyramid; returns the background's homography (empty for a static
  /// camera or none found).
  cv::Mat step(const std::vector<cv::Mat>& pyramid, cv::Size size, const cv::Mat1b& counts) {
    std::vector<cv::Point2f> from, to, back;
    for (const auto& track : live_) from.push_back(track.px.back());
    const std::vector<bool> good = follow_both_ways(pyramid, size, from, to, back);
    const cv::Mat homography = options_.camera_moves ? background_motion(from, to, good) : cv::Mat();
    std::vector<LiveTrack> kept;
    for (std::size_t i = 0; i < live_.size(); ++i) {
      if (!good[i] || (!counts.empty() && counts(cv::Point(to[i])) == 0)) {
        retire(std::move(live_[i]));
        continue;
      }
      extend(live_[i], to[i], homography);
      kept.push_back(std::move(live_[i]));
    }
    live_ = std::move(kept);
    return homography;
  }

  std::vector<bool> follow_both_ways(const std::vector<cv::Mat>& pyramid, cv::Size size,
                                     const std::vector<cv::Point2f>& from, std::vector<cv::Point2f>& to,
                                     std::vector<cv::Point2f>& back) const {
    const cv::Size window(options_.window_px, options_.window_px);
    const cv::TermCriteria stop(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 0.005);
    std::vector<uchar> ok, ok_back;
    std::vector<float> error;
    cv::calcOpticalFlowPyrLK(pyramid_, pyramid, from, to, ok, error, window, kPyramidLevels, stop);
    back = from;
    cv::calcOpticalFlowPyrLK(pyramid, pyramid_, to, back, ok_back, error, window, kPyramidLevels, stop,
                             cv::OPTFLOW_USE_INITIAL_FLOW);
    const float margin = 1;
    const cv::Rect2f inside(margin, margin, static_cast<float>(size.width) - 1 - 2 * margin,
                            static_cast<float>(size.height) - 1 - 2 * margin);
    std::vector<bool> good(from.size());
    for (std::size_t i = 0; i < from.size(); ++i)
      good[i] = ok[i] && ok_back[i] && inside.contains(to[i]) &&
                cv::norm(back[i] - from[i]) <= options_.max_forward_backward_px;
    return good;
  }

  static cv::Mat background_motion(const std::vector<cv::Point2f>& from, const std::vector<cv::Point2f>& to,
                                   const std::vector<bool>& good) {
    std::vector<cv::Point2f> a, b;
    for (std::size_t i = 0; i < from.size(); ++i)
      if (good[i]) a.push_back(from[i]), b.push_back(to[i]);
    if (a.size() < 8) return {};
    return cv::findHomography(a, b, cv::RANSAC, kMaxHomographyErrorPx);
  }

  static void extend(LiveTrack& track, const cv::Point2f& to, const cv::Mat& homography) {
    cv::Point2f moved = to - track.px.back();
    if (!homography.empty()) {
      std::vector<cv::Point2f> carried;
      cv::perspectiveTransform(std::vector<cv::Point2f>{track.px.back()}, carried, homography);
      moved = to - carried[0];
    }
    track.residual.push_back(track.residual.back() + moved);
    track.px.push_back(to);
  }

  void find_corners(int frame, const cv::Mat1b& grey, const cv::Mat1b& moving, const cv::Mat1b& counts) {
    const double spacing =
        std::max(8.0, 0.6 * std::sqrt(static_cast<double>(grey.total()) / std::max(1, options_.max_background)));
    cv::Mat1b still;
    cv::bitwise_not(moving, still);
    add_corners(frame, grey, only(moving, counts), options_.max_moving, kMovingSpacingPx, true);
    add_corners(frame, grey, only(still, counts), options_.max_background, spacing, false);
  }

  static cv::Mat1b only(const cv::Mat1b& where, const cv::Mat1b& counts) {
    if (counts.empty()) return where;
    cv::Mat1b both;
    cv::bitwise_and(where, counts, both);
    return both;
  }

  void add_corners(int frame, const cv::Mat1b& grey, const cv::Mat1b& where, int max_live, double spacing_px,
                   bool in_moving_region) {
    cv::Mat1b mask = where.clone();
    int num_live = 0;
    for (const auto& track : live_) {
      num_live += track.in_moving_region == in_moving_region ? 1 : 0;
      cv::circle(mask, track.px.back(), static_cast<int>(spacing_px), cv::Scalar(0), cv::FILLED);
    }
    const int room = max_live - num_live;
    cv::Rect box = cv::boundingRect(mask);
    if (room <= 0 || box.empty()) return;
    // Only around what is looked at, with room for the corner measure's windows: the same corners for less.
    box = (box + cv::Size(2 * kCornerMargin, 2 * kCornerMargin) - cv::Point(kCornerMargin, kCornerMargin)) &
          cv::Rect({}, grey.size());
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(grey(box), corners, room, kCornerQuality, spacing_px, mask(box), kCornerBlock);
    if (corners.empty()) return;
    for (auto& corner : corners) corner += cv::Point2f(box.tl());
    cv::cornerSubPix(grey, corners, {2, 2}, {-1, -1}, {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 20, 0.01});
    for (const auto& corner : corners) live_.push_back({frame, {corner}, {{0, 0}}, in_moving_region});
  }

  void retire(LiveTrack&& track) {
    if (static_cast<int>(track.px.size()) < options_.min_frames) return;
    const cv::Rect2f extent = extent_of(track.residual);
    Track out{.first_frame = track.first_frame,
              .px = {},
              .moving = false,
              .motion_px = std::hypot(extent.width, extent.height),
              .looks = {}};
    out.moving = out.motion_px >= static_cast<float>(options_.min_motion_px);
    for (const auto& p : track.px) out.px.emplace_back(p.x + kCentre, p.y + kCentre);
    done_.push_back(std::move(out));
  }
  static cv::Rect2f extent_of(const std::vector<cv::Point2f>& path) {
    const auto [left, right] =
        std::minmax_element(path.begin(), path.end(), [](auto& a, auto& b) { return a.x < b.x; });
    const auto [top, bottom] =
        std::minmax_element(path.begin(), path.end(), [](auto& a, auto& b) { return a.y < b.y; });
    return {left->x, top->y, right->x - left->x, bottom->y - top->y};
  }

  FollowOptions options_;
  MovingRegions regions_;
  cv::Mat1b grey_;
  std::vector<cv::Mat> pyramid_;  // of grey_, with derivatives
  std::vector<LiveTrack> live_;
  std::vector<Track> done_;
};

}  // namespace

std::vector<Track> follow_features(int num_frames, const GreyFrames& grey, const FollowOptions& options,
                                   const std::function<void(double)>& on_progress, const FrameMasks& counts) {
  if (num_frames < 2) return {};
  std::optional<cv::Mat1b> plate;
  if (!options.camera_moves) plate = background_plate(num_frames, grey);
  Follower follower(options, std::move(plate));
  for (int frame = 0; frame < num_frames; ++frame) {
    follower.add_frame(frame, grey(frame), counts ? counts(frame) : cv::Mat1b());
    if (on_progress) on_progress((frame + 1.0) / num_frames);
  }
  return follower.finish();
}

}  // namespace vantage::track
