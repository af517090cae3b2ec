#include "jobs/correspond/match_images.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "jobs/correspond/dis_flow.h"
#include "tests/support/synthetic_scene.h"

namespace vantage {
namespace {

using synthetic::kFirstMovingId;
using synthetic::Picture;
using synthetic::Scene;
using synthetic::SceneCamera;
using synthetic::Truth;

/// Two exposures with everything known of them.
struct Pair {
  Picture a, b;
  PosedPicture posed_a, posed_b;
  Truth ab, ba;
};

PosedPicture posed(const Picture& picture, const SceneCamera& camera) {
  PosedPicture out{{}, camera.pinhole, camera.cam_from_world};
  cv::cvtColor(picture.bgr, out.grey, cv::COLOR_BGR2GRAY);
  return out;
}

Pair expose(const Scene& scene, const SceneCamera& a, double time_a_s, const SceneCamera& b, double time_b_s) {
  Pair p;
  p.a = scene.render(a.pinhole, a.cam_from_world, time_a_s);
  p.b = scene.render(b.pinhole, b.cam_from_world, time_b_s);
  p.posed_a = posed(p.a, a);
  p.posed_b = posed(p.b, b);
  p.ab = scene.correspondence(p.a, a.pinhole, a.cam_from_world, time_a_s, b.pinhole, b.cam_from_world, time_b_s);
  p.ba = scene.correspondence(p.b, b.pinhole, b.cam_from_world, time_b_s, a.pinhole, a.cam_from_world, time_a_s);
  return p;
}

/// Two neighbours on an arc, 8 degrees apart.
Pair neighbours(bool moving, double time_b_s) {
  const auto cameras = synthetic::arc_cameras(3, 1, 320, 180);
  return expose(Scene({.moving = moving, .noise_sigma = 1}), cameras[0], 0.3, cameras[1], time_b_s);
}

struct Errors {
  double median_px = 1e9, over_3px_percent = 100;
};

/// Over pixels that the other picture shows and that `of` marks.
Errors errors(const FlowMap& flow, const Truth& truth, const cv::Mat1b& of) {
  std::vector<double> lengths;
  for (int y = 0; y < of.rows; ++y)
    for (int x = 0; x < of.cols; ++x)
      if (truth.visible(y, x) && of(y, x)) lengths.push_back(cv::norm(flow.motion_px(y, x) - truth.motion_px(y, x)));
  if (lengths.empty()) return {};
  const auto far = std::count_if(lengths.begin(), lengths.end(), [](double e) { return e > 3; });
  std::nth_element(lengths.begin(), lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2), lengths.end());
  return {lengths[lengths.size() / 2], 100.0 * static_cast<double>(far) / static_cast<double>(lengths.size())};
}

cv::Mat1b everything(const Picture& picture) { return {picture.id.size(), uchar{255}}; }
cv::Mat1b moving_things(const Picture& picture) {
  cv::Mat mask = picture.id >= kFirstMovingId;
  return mask;
}

/// Share of truly hidden pixels that have confidence 0; one pixel along the rim is left out.
double hidden_found_percent(const FlowMap& flow, const Truth& truth) {
  cv::Mat hidden = truth.visible == 0;
  cv::erode(hidden, hidden, cv::Mat());
  const cv::Mat found = (flow.confidence == 0) & hidden;
  return 100.0 * cv::countNonZero(found) / cv::countNonZero(hidden);
}

TEST(MatchImages, StaticSceneFromTwoPlacesIsMatchedToAFractionOfAPixelBothWays) {
  const Pair p = neighbours(false, 0.3);
  const ImageMatch match = match_images(p.posed_a, p.posed_b, {});
  EXPECT_EQ(match.model, ImageMatch::Model::StaticScene);
  const Errors forward = errors(match.forward, p.ab, everything(p.a)),
               backward = errors(match.backward, p.ba, everything(p.b));
  EXPECT_LT(forward.median_px, 0.15);
  EXPECT_LT(backward.median_px, 0.15);
  EXPECT_LT(forward.over_3px_percent, 4);
  EXPECT_LT(backward.over_3px_percent, 4);
  EXPECT_LT(median_epipolar_residual_px(match, p.posed_a, p.posed_b), 0.15);
}

TEST(MatchImages, PosesThatAreOffByHalfAPixelCostLittle) {
  Pair p = neighbours(false, 0.3);
  const double off_rad = 0.5 / p.posed_b.pinhole.fy;
  p.posed_b.cam_from_world.R = Eigen::AngleAxisd(off_rad, Eigen::Vector3d::UnitX()) * p.posed_b.cam_from_world.R;
  p.posed_b.cam_from_world.t = Eigen::AngleAxisd(off_rad, Eigen::Vector3d::UnitX()) * p.posed_b.cam_from_world.t;
  const ImageMatch match = match_images(p.posed_a, p.posed_b, {});
  EXPECT_LT(errors(match.forward, p.ab, everything(p.a)).median_px, 0.2);
  EXPECT_LT(errors(match.backward, p.ba, everything(p.b)).median_px, 0.2);
}

TEST(MatchImages, AFloorIsMatchedFromFarApart) {
  const auto cameras = synthetic::arc_cameras(2, 1, 320, 180, 24);
  const Pair p = expose(Scene({.moving = false, .noise_sigma = 1}), cameras[0], 0.3, cameras[1], 0.3);
  const ImageMatch match = match_images(p.posed_a, p.posed_b, {});
  cv::Mat on_floor = p.a.id == 0;
  const Errors floor = errors(match.forward, p.ab, on_floor);
  EXPECT_LT(floor.median_px, 0.3);
  EXPECT_LT(floor.over_3px_percent, 5);
}

TEST(MatchImages, HiddenSurfacesHaveNoConfidenceAndMostOthersHave) {
  const Pair p = neighbours(false, 0.3);
  const ImageMatch match = match_images(p.posed_a, p.posed_b, {});
  EXPECT_GT(hidden_found_percent(match.forward, p.ab), 75);
  EXPECT_GT(hidden_found_percent(match.backward, p.ba), 75);
  const cv::Mat sure = (match.forward.confidence > 0) & (p.ab.visible > 0);
  EXPECT_GT(cv::countNonZero(sure), 0.93 * cv::countNonZero(p.ab.visible));
}

TEST(MatchImages, ThingsThatMovedBetweenExposuresAreFoundOffTheEpipolarLine) {
  const Pair p = neighbours(true, 0.335);
  const ImageMatch match = match_images(p.posed_a, p.posed_b, {});
  FlowPair stereo;
  ASSERT_TRUE(stereo_flow(p.posed_a, p.posed_b, {}, stereo));
  const Errors moving = errors(match.forward, p.ab, moving_things(p.a));
  const Errors moving_stereo = errors({stereo.a_to_b, {}}, p.ab, moving_things(p.a));
  EXPECT_LT(moving.median_px, 0.5);
  EXPECT_LT(moving.median_px, 0.7 * moving_stereo.median_px);
  EXPECT_LT(errors(match.forward, p.ab, everything(p.a)).median_px, 0.3);
}

TEST(MatchImages, FramesOfAFixedCameraDifferOnlyWhereThingsMove) {
  const auto cameras = synthetic::arc_cameras(2, 2, 320, 180);
  const Pair p = expose(Scene({.noise_sigma = 1}), cameras[0], 0.3, cameras[0], 0.3 + 1.0 / 30);
  const ImageMatch match = match_images(p.posed_a, p.posed_b, {});
  EXPECT_EQ(match.model, ImageMatch::Model::FixedCamera);
  const cv::Mat1b moving = moving_things(p.a);
  cv::Mat1b still;
  cv::bitwise_not(moving, still);
  EXPECT_LT(errors(match.forward, p.ab, moving).median_px, 0.4);
  EXPECT_LT(errors(match.forward, p.ab, still).median_px, 1e-6);
  EXPECT_LT(errors(match.forward, p.ab, still).over_3px_percent, 0.5);
}

TEST(MatchImages, GainAndOffsetBetweenCamerasDoNotMatter) {
  const Pair p = neighbours(false, 0.3);
  PosedPicture darker = p.posed_b;
  p.posed_b.grey.convertTo(darker.grey, CV_8U, 0.7, 12);
  const ImageMatch match = match_images(p.posed_a, darker, {});
  EXPECT_LT(errors(match.forward, p.ab, everything(p.a)).median_px, 0.35);
}

TEST(MatchImages, SamePoseAndPictureDoNotMove) {
  const Pair p = neighbours(false, 0.3);
  const ImageMatch match = match_images(p.posed_a, p.posed_a, {});
  EXPECT_EQ(cv::norm(match.forward.motion_px, cv::NORM_INF), 0);
  EXPECT_EQ(confident_percent(match.backward), 100);
}

TEST(MatchImages, SameBytesOnEveryRunAndForAnyNumberOfThreads) {
  const Pair p = neighbours(true, 0.335);
  const int threads_before = cv::getNumThreads();
  cv::setNumThreads(1);
  const ImageMatch one = match_images(p.posed_a, p.posed_b, {});
  cv::setNumThreads(2);
  const ImageMatch two = match_images(p.posed_a, p.posed_b, {});
  cv::setNumThreads(threads_before);
  EXPECT_EQ(cv::norm(one.forward.motion_px, two.forward.motion_px, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(one.backward.motion_px, two.backward.motion_px, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(one.forward.confidence, two.forward.confidence, cv::NORM_INF), 0);
}

TEST(MatchImages, LargePicturesAreMatchedSmallerAndStillHitThePixel) {
  const Pair p = neighbours(false, 0.3);
  MatchOptions options;
  options.stereo.max_pixels = 20'000;
  EXPECT_LT(errors(match_images(p.posed_a, p.posed_b, options).forward, p.ab, everything(p.a)).median_px, 0.5);
}

TEST(WithLevelsOf, BringsBackGainAndOffset) {
  cv::Mat1b grey(64, 64), changed;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) grey(y, x) = static_cast<uchar>(20 + 3 * x);
  grey.convertTo(changed, CV_8U, 0.6, 30);
  EXPECT_LE(cv::norm(with_levels_of(grey, changed), grey, cv::NORM_INF), 3);
}

}  // namespace
}  // namespace vantage
