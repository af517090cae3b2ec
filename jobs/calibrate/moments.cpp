#include "jobs/calibrate/moments.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace vantage {
namespace {

constexpr double kSameMoment = 0.02;  // of a frame: at 30 px per frame half a pixel
constexpr double kMaxReturnPx = 0.7;  // a feature followed there and back must come home

bool has_clock(const FilmedCamera& camera) { return camera.start_s && !camera.moving && camera.table.num_frames() > 1; }

int num_filming(const std::vector<FilmedCamera>& cameras, double time_s) {
  return static_cast<int>(
      std::count_if(cameras.begin(), cameras.end(), [&](const auto& c) { return frame_near(c, time_s).has_value(); }));
}

cv::Mat grey_frame(const FrameReader& read, const ImageId& image) {
  cv::Mat grey;
  cv::cvtColor(read(image), grey, cv::COLOR_BGR2GRAY);
  return grey;
}

/// The features that are found again in another frame, and by how much they move to it.
struct Followed {
  std::vector<std::size_t> kept;
  std::vector<Eigen::Vector2d> moved_px;
};

Followed follow(const Features& features, const cv::Mat& from, const cv::Mat& to) {
  Followed out;
  std::vector<cv::Point2f> here, there, back;
  for (const auto& px : features.px)
    here.emplace_back(static_cast<float>(px.x() - 0.5), static_cast<float>(px.y() - 0.5));
  if (here.empty()) return out;
  std::vector<uchar> found, returned;
  const cv::Size window(15, 15);
  cv::calcOpticalFlowPyrLK(from, to, here, there, found, cv::noArray(), window, 4);
  cv::calcOpticalFlowPyrLK(to, from, there, back, returned, cv::noArray(), window, 4);
  for (std::size_t i = 0; i < here.size(); ++i) {
    if (!found[i] || !returned[i] || cv::norm(back[i] - here[i]) > kMaxReturnPx) continue;
    out.kept.push_back(i);
    out.moved_px.emplace_back(there[i].x - here[i].x, there[i].y - here[i].y);
  }
  return out;
}

Features chosen(const Features& features, const std::vector<std::size_t>& kept) {
  Features out;
  out.descriptors.resize(static_cast<Eigen::Index>(kept.size()), 128);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    out.px.push_back(features.px[kept[i]]);
    out.rgb.push_back(features.rgb[kept[i]]);
    out.descriptors.row(static_cast<Eigen::Index>(i)) = features.descriptors.row(static_cast<Eigen::Index>(kept[i]));
  }
  return out;
}

/// share: of the way to the other frame.
void carry(Survey::Glimpse& glimpse, double share, const cv::Mat& from, const cv::Mat& to) {
  const Followed followed = follow(glimpse.features, from, to);
  glimpse.features = chosen(glimpse.features, followed.kept);
  for (std::size_t i = 0; i < followed.moved_px.size(); ++i) {
    glimpse.carried_px.push_back(share * followed.moved_px[i]);
    glimpse.features.px[i] += glimpse.carried_px[i];
  }
}

}  // namespace

std::optional<int> frame_near(const FilmedCamera& camera, double time_s) {
  if (!has_clock(camera)) return std::nullopt;
  const auto& pts = camera.table.pts_s;
  const double at = time_s - *camera.start_s, slack = 1e-6;
  if (at < pts.front() - slack || at > pts.back() + slack) return std::nullopt;
  const auto after = std::min(std::lower_bound(pts.begin(), pts.end(), at), std::prev(pts.end()));
  const auto before = after == pts.begin() ? after : std::prev(after);
  return static_cast<int>((at - *before < *after - at ? before : after) - pts.begin());
}

std::vector<double> choose_moments(const std::vector<FilmedCamera>& cameras, int max_moments) {
  std::vector<double> times;
  for (const auto& camera : cameras) {
    if (!has_clock(camera)) continue;
    for (const double pts : camera.table.pts_s)
      if (num_filming(cameras, *camera.start_s + pts) >= 2) times.push_back(*camera.start_s + pts);
    if (!times.empty()) break;
  }
  std::vector<double> out;
  for (const int i : spread_frames(static_cast<int>(times.size()), max_moments))
    out.push_back(times[static_cast<std::size_t>(i)]);
  return out;
}

std::optional<Survey::Glimpse> glimpse_of_motion(const FilmedCamera& camera, const Plate& plate, int moment,
                                                 double time_s, const Footage& footage, const FeatureOptions& options) {
  const auto frame = frame_near(camera, time_s);
  if (!frame) return std::nullopt;
  const cv::Mat bgr = footage.frame({camera.table.camera, *frame});
  cv::Mat moving = what_moves(bgr, plate);
  if (const cv::Mat counts = footage.counts(camera.table.camera, {*frame}); !counts.empty()) moving &= counts;
  Survey::Glimpse out{.moment = moment, .frame = frame, .features = {}, .carried_px = {}};
  out.features = find_features(bgr, moving, options);
  const auto& pts = camera.table.pts_s;
  const double late_s = time_s - *camera.start_s - pts[static_cast<std::size_t>(*frame)];
  if (std::abs(late_s) * camera.table.fps <= kSameMoment) return out;
  const int other = *frame + (late_s > 0 ? 1 : -1);
  const double apart_s = pts[static_cast<std::size_t>(other)] - pts[static_cast<std::size_t>(*frame)];
  carry(out, late_s / apart_s, grey_frame(footage.frame, {camera.table.camera, *frame}),
        grey_frame(footage.frame, {camera.table.camera, other}));
  return out;
}

}  // namespace vantage
