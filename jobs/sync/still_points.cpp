#include "jobs/sync/still_points.h"

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "jobs/sync/pair_geometry.h"

namespace vantage::sync {
namespace {

constexpr int kMaxPictures = 9;
constexpr int kMaxFeatures = 4000;
constexpr float kRatio = 0.8F;
/// Grey levels from darkest to brightest beyond which a pixel is no still one: codecs and noise stay below.
constexpr int kMaxRange = 24;
constexpr int kMotionMarginPx = 4;
constexpr double kMaxPx = 2;
constexpr int kDraws = 2000;
constexpr std::size_t kMinMatches = 16;
constexpr double kMinShare = 1.0 / 3;

struct StillPicture {
  cv::Mat1b median, still;  // still: 255 where nothing moves
};

StillPicture still_picture(const GreyFrames& grey, int num_frames) {
  std::vector<cv::Mat1b> pictures;
  const int num = std::min(num_frames, kMaxPictures);
  for (int k = 0; k < num; ++k) pictures.push_back(grey(num < 2 ? 0 : k * (num_frames - 1) / (num - 1)));
  StillPicture out{cv::Mat1b(pictures[0].size()), cv::Mat1b(pictures[0].size())};
  std::vector<std::uint8_t> values(pictures.size());
  for (int y = 0; y < out.median.rows; ++y)
    for (int x = 0; x < out.median.cols; ++x) {
      for (std::size_t k = 0; k < pictures.size(); ++k) values[k] = pictures[k](y, x);
      std::sort(values.begin(), values.end());
      out.median(y, x) = values[values.size() / 2];
      out.still(y, x) = values.back() - values.front() <= kMaxRange ? 255 : 0;
    }
  cv::erode(out.still, out.still, cv::Mat(), {-1, -1}, kMotionMarginPx);
  return out;
}

struct Features {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
};

Features features_of(const StillPicture& picture) {
  Features out;
  cv::SIFT::create(kMaxFeatures)->detectAndCompute(picture.median, picture.still, out.keypoints, out.descriptors);
  return out;
}

/// For each of a the index of its best in b, -1 where the second is nearly as good.
std::vector<int> best_matches(const cv::Mat& a, const cv::Mat& b) {
  std::vector<std::vector<cv::DMatch>> knn;
  cv::BFMatcher(cv::NORM_L2).knnMatch(a, b, knn, 2);
  std::vector<int> best;
  for (const auto& two : knn)
    best.push_back(two.size() == 2 && two[0].distance < kRatio * two[1].distance ? two[0].trainIdx : -1);
  return best;
}

Eigen::Vector2d centre_of(const cv::KeyPoint& k) { return {double{k.pt.x} + 0.5, double{k.pt.y} + 0.5}; }

}  // namespace

std::vector<PointMatch> match_still_points(const GreyFrames& grey_a, int num_frames_a, const GreyFrames& grey_b,
                                           int num_frames_b) {
  if (num_frames_a < 1 || num_frames_b < 1) return {};
  const Features a = features_of(still_picture(grey_a, num_frames_a)),
                 b = features_of(still_picture(grey_b, num_frames_b));
  if (a.descriptors.rows < 2 || b.descriptors.rows < 2) return {};
  const std::vector<int> forth = best_matches(a.descriptors, b.descriptors),
                         back = best_matches(b.descriptors, a.descriptors);
  std::vector<PointMatch> matches;
  for (std::size_t k = 0; k < forth.size(); ++k)
    if (forth[k] >= 0 && back[static_cast<std::size_t>(forth[k])] == static_cast<int>(k))
      matches.push_back({centre_of(a.keypoints[k]), centre_of(b.keypoints[static_cast<std::size_t>(forth[k])])});
  if (matches.size() < kMinMatches) return {};
  std::mt19937 random(8);
  const auto found = robust_fundamental(matches, kMaxPx, kDraws, {}, random);
  const std::size_t num_all = matches.size();
  std::erase_if(matches, [&](const PointMatch& m) { return std::abs(sampson_px(found->F, m.a, m.b)) > kMaxPx; });
  const bool believable =
      matches.size() >= kMinMatches && static_cast<double>(matches.size()) >= kMinShare * static_cast<double>(num_all);
  return believable ? matches : std::vector<PointMatch>{};
}

}  // namespace vantage::sync
