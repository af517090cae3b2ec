#include "jobs/track/looks.h"

#include <algorithm>
#include <map>
#include <opencv2/features2d.hpp>

#include "schema/base/error.h"

namespace vantage::track {
namespace {

constexpr int kMaxLooks = 6;
/// A SIFT descriptor's window is six times the key point's size wide.
constexpr float kWindowPerSize = 6;
constexpr float kWindowPerWidth = 1.0F / 22;

/// Which tracks are described in which frames.
std::map<int, std::vector<std::size_t>> plan_looks(const std::vector<Track>& tracks) {
  std::map<int, std::vector<std::size_t>> by_frame;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    if (!tracks[i].moving) continue;
    const int length = static_cast<int>(tracks[i].px.size());
    const int num = std::min(kMaxLooks, (length + 3) / 4);
    for (int k = 0; k < num; ++k) by_frame[tracks[i].first_frame + (2 * k + 1) * length / (2 * num)].push_back(i);
  }
  return by_frame;
}

}  // namespace

void describe_moving_tracks(std::vector<Track>& tracks, int num_frames, const GreyFrames& grey) {
  const auto sift = cv::SIFT::create();
  for (const auto& [frame, indices] : plan_looks(tracks)) {
    check(frame < num_frames, "tracks end with the footage");
    const cv::Mat1b picture = grey(frame);
    std::vector<cv::KeyPoint> points;
    for (const std::size_t i : indices) {
      const auto& px = tracks[i].px[static_cast<std::size_t>(frame - tracks[i].first_frame)];
      points.emplace_back(px.x() - 0.5F, px.y() - 0.5F,
                          static_cast<float>(picture.cols) * kWindowPerWidth / kWindowPerSize, 0.0F, 0.0F, 0,
                          static_cast<int>(i));
    }
    cv::Mat descriptors;
    sift->compute(picture, points, descriptors);
    for (std::size_t k = 0; k < points.size(); ++k) {
      TrackLook look{.frame = frame, .descriptor = {}};
      for (std::size_t d = 0; d < look.descriptor.size(); ++d)
        look.descriptor[d] = cv::saturate_cast<uchar>(descriptors.at<float>(static_cast<int>(k), static_cast<int>(d)));
      tracks[static_cast<std::size_t>(points[k].class_id)].looks.push_back(look);
    }
  }
}

}  // namespace vantage::track
