#include "jobs/calibrate/survey.h"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "jobs/calibrate/plate.h"
#include "jobs/vision/shot_images.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kFewPictures = 40;  // 780 pairs, about a second each
constexpr int kNextKeyFrames = 5;

cv::Mat plate_of(const FrameTable& table, const FrameReader& read, int plate_frames) {
  std::vector<cv::Mat> pictures;
  for (const int frame : spread_frames(table.num_frames(), plate_frames))
    pictures.push_back(read({table.camera, frame}));
  return median_plate(pictures);
}

bool worth_matching(const Survey::Picture& a, const Survey::Picture& b, double spacing) {
  if (!a.moving || !b.moving) return true;
  const double apart = std::abs(a.position - b.position) / spacing;
  return apart <= (a.image.camera == b.image.camera ? kNextKeyFrames + 0.5 : 1.5);
}

struct Features {
  std::vector<cv::KeyPoint> points;
  cv::Mat descriptors;
};

Features features_of(const fs::path& picture) {
  cv::Mat grey;
  cv::cvtColor(read_picture(picture), grey, cv::COLOR_BGR2GRAY);
  const double scale = std::min(1.0, 800.0 / std::max(grey.cols, grey.rows));
  cv::resize(grey, grey, {}, scale, scale, cv::INTER_AREA);
  Features out;
  cv::SIFT::create(2000)->detectAndCompute(grey, cv::noArray(), out.points, out.descriptors);
  return out;
}

int num_common(const Features& a, const Features& b) {
  if (a.descriptors.rows < 8 || b.descriptors.rows < 8) return 0;
  std::vector<std::vector<cv::DMatch>> matches;
  cv::BFMatcher(cv::NORM_L2).knnMatch(a.descriptors, b.descriptors, matches, 2);
  std::vector<cv::Point2f> in_a, in_b;
  for (const auto& m : matches)
    if (m.size() == 2 && m[0].distance < 0.8F * m[1].distance) {
      in_a.push_back(a.points[static_cast<std::size_t>(m[0].queryIdx)].pt);
      in_b.push_back(b.points[static_cast<std::size_t>(m[0].trainIdx)].pt);
    }
  if (in_a.size() < 8) return 0;
  cv::Mat is_inlier;
  cv::findFundamentalMat(in_a, in_b, cv::FM_RANSAC, 2.0, 0.999, is_inlier);
  return is_inlier.empty() ? 0 : cv::countNonZero(is_inlier);
}

}  // namespace

std::string Survey::Picture::name() const { return fmt::format("{}/{:06d}.png", image.camera, image.frame); }

std::vector<PicturePair> Survey::pairs() const {
  std::vector<PicturePair> out;
  std::map<std::string, int> num_of_camera;
  int most = 2;
  for (const auto& p : pictures) most = std::max(most, ++num_of_camera[p.image.camera]);
  const double spacing = 1.0 / (most - 1);
  for (std::size_t i = 0; i < pictures.size(); ++i)
    for (std::size_t j = i + 1; j < pictures.size(); ++j)
      if (pictures.size() <= kFewPictures || worth_matching(pictures[i], pictures[j], spacing))
        out.emplace_back(pictures[i].name(), pictures[j].name());
  return out;
}

Survey write_survey(const fs::path& folder, const std::vector<FilmedCamera>& cameras, const FrameReader& read,
                    int plate_frames, int max_key_frames) {
  Survey survey;
  const auto add = [&](const Survey::Picture& picture, const cv::Mat& bgr) {
    fs::create_directories(folder / picture.image.camera);
    write_picture(folder / picture.name(), bgr);
    survey.pictures.push_back(picture);
  };
  for (const auto& [table, moving] : cameras) {
    if (!moving) {
      add({.image = {table.camera, 0}, .position = 0, .moving = false}, plate_of(table, read, plate_frames));
      continue;
    }
    for (const int frame : spread_frames(table.num_frames(), max_key_frames))
      add({.image = {table.camera, frame}, .position = frame / std::max(1.0, table.num_frames() - 1.0), .moving = true},
          read({table.camera, frame}));
  }
  return survey;
}

BestPair best_pair(const fs::path& folder, const Survey& survey) {
  // One picture of every camera says enough.
  std::map<std::string, Features> features;
  for (const auto& picture : survey.pictures)
    if (!features.contains(picture.image.camera)) features[picture.image.camera] = features_of(folder / picture.name());
  BestPair best;
  for (auto a = features.begin(); a != features.end(); ++a)
    for (auto b = std::next(a); b != features.end(); ++b) {
      cv::theRNG().state = 1;
      const int num = num_common(a->second, b->second);
      if (best.a.empty() || num > best.num_matches) best = {a->first, b->first, num};
    }
  return best;
}

}  // namespace vantage
