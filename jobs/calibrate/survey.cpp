#include "jobs/calibrate/survey.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "jobs/calibrate/moments.h"
#include "jobs/calibrate/plate.h"

namespace vantage {
namespace {

constexpr std::size_t kFewPictures = 40;  // 780 pairs, about a second each
constexpr int kNextKeyFrames = 5;

bool worth_matching(const Survey::Picture& a, const Survey::Picture& b, double spacing) {
  if (!a.moving || !b.moving) return true;
  const double apart = std::abs(a.position - b.position) / spacing;
  return apart <= (a.image.camera == b.image.camera ? kNextKeyFrames + 0.5 : 1.5);
}

Plate plate_of(const FilmedCamera& camera, const Footage& footage, int plate_frames) {
  const std::vector<int> frames = spread_frames(camera.table.num_frames(), plate_frames);
  std::vector<cv::Mat> pictures;
  for (const int frame : frames) pictures.push_back(footage.frame({camera.table.camera, frame}));
  Plate plate = make_plate(pictures);
  if (const cv::Mat counts = footage.counts(camera.table.camera, frames); !counts.empty()) plate.steady &= counts;
  return plate;
}

Survey::Picture static_picture(const FilmedCamera& camera, const std::vector<double>& moments, const Footage& footage,
                               const SurveyOptions& options) {
  const Plate plate = plate_of(camera, footage, options.plate_frames);
  Survey::Picture out{
      .image = {camera.table.camera, 0}, .width = plate.bgr.cols, .height = plate.bgr.rows, .glimpses = {}};
  out.glimpses.push_back(
      {.frame = {}, .features = find_features(plate.bgr, plate.steady, options.features), .carried_px = {}});
  for (std::size_t k = 0; k < moments.size(); ++k)
    if (auto glimpse = glimpse_of_motion(camera, plate, static_cast<int>(k), moments[k], footage, options.features))
      out.glimpses.push_back(std::move(*glimpse));
  return out;
}

Survey::Picture key_picture(const FilmedCamera& camera, int frame, const Footage& footage,
                            const FeatureOptions& options) {
  const ImageId image{camera.table.camera, frame};
  const cv::Mat bgr = footage.frame(image);
  Survey::Picture out{.image = image, .width = bgr.cols, .height = bgr.rows, .moving = true, .glimpses = {}};
  out.position = frame / std::max(1.0, camera.table.num_frames() - 1.0);
  out.glimpses.push_back({.frame = frame,
                          .features = find_features(bgr, footage.counts(image.camera, {frame}), options),
                          .carried_px = {}});
  return out;
}

}  // namespace

std::string Survey::Picture::name() const { return fmt::format("{}/{:06d}.png", image.camera, image.frame); }

std::size_t Survey::Picture::num_features() const {
  std::size_t num = 0;
  for (const auto& glimpse : glimpses) num += glimpse.features.size();
  return num;
}

std::vector<std::pair<int, int>> Survey::pairs() const {
  std::vector<std::pair<int, int>> out;
  std::map<std::string, int> num_of_camera;
  int most = 2;
  for (const auto& p : pictures) most = std::max(most, ++num_of_camera[p.image.camera]);
  const double spacing = 1.0 / (most - 1);
  for (std::size_t i = 0; i < pictures.size(); ++i)
    for (std::size_t j = i + 1; j < pictures.size(); ++j)
      if (pictures.size() <= kFewPictures || worth_matching(pictures[i], pictures[j], spacing))
        out.emplace_back(static_cast<int>(i), static_cast<int>(j));
  return out;
}

/// Four a second show enough of a walk, and are few enough to be adjusted together; a short clip has six.
std::vector<int> key_frames_of(const FrameTable& table, int max_key_frames) {
  const double duration_s = table.pts_s.back() - table.pts_s.front();
  const int wanted = std::max(6, 1 + static_cast<int>(duration_s * 4));
  return spread_frames(table.num_frames(), std::min(wanted, max_key_frames));
}

Survey take_survey(const std::vector<FilmedCamera>& cameras, const Footage& footage, const SurveyOptions& options,
                   const std::function<void(double)>& on_progress) {
  Survey survey;
  const std::vector<double> moments = choose_moments(cameras, options.max_moments);
  double num_done = 0;
  for (const auto& camera : cameras) {
    if (!camera.moving) {
      survey.pictures.push_back(static_picture(camera, moments, footage, options));
    } else {
      for (const int frame : key_frames_of(camera.table, options.max_key_frames))
        survey.pictures.push_back(key_picture(camera, frame, footage, options.features));
    }
    on_progress(++num_done / static_cast<double>(cameras.size()));
  }
  return survey;
}

}  // namespace vantage
