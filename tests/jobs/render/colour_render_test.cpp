/// Cameras of different colours: what their shared look does for a drawn view.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <opencv2/core.hpp>

#include "jobs/calibrate/colour_samples.h"
#include "jobs/calibrate/colour_solve.h"
#include "jobs/render/render_view.h"
#include "jobs/vision/colour_space.h"
#include "tests/support/synthetic_scene.h"

namespace vantage {
namespace {

/// Linear light times a gain for red, green and blue.
cv::Mat3b film(const cv::Mat3b& bgr, const std::array<double, 3>& gain) {
  cv::Mat3b out(bgr.size());
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x)
      for (int c = 0; c < 3; ++c)
        out(y, x)[c] = cv::saturate_cast<uchar>(
            level_of_linear(gain[static_cast<std::size_t>(2 - c)] * linear_of_level(bgr(y, x)[c])));
  return out;
}

cv::Mat3b in_shared_look(const cv::Mat3b& bgr, const CameraColour& colour) {
  cv::Mat3b out = bgr.clone();
  for (int c = 0; c < 3; ++c) {
    const auto table = level_table(colour, 2 - c);
    for (auto& pixel : out) pixel[c] = table[pixel[c]];
  }
  return out;
}

class ViewBetweenTwoCameras : public testing::Test {
 protected:
  ViewBetweenTwoCameras() {
    // Geometric mean 1, so that the shared look is the scene's own.
    const std::vector<std::array<double, 3>> gains{{0.8, 0.9, 1.2}, {1 / 0.8, 1 / 0.9, 1 / 1.2}};
    for (std::size_t k = 0; k < cameras_.size(); ++k) {
      const auto& camera = cameras_[k];
      const auto picture = scene_.render(camera.pinhole, camera.cam_from_world, 0);
      SourceImage image;
      image.id = {camera.name, 0};
      image.pinhole = camera.pinhole;
      image.cam_from_world = camera.cam_from_world;
      filmed_.push_back(film(picture.bgr, gains[k]));
      image.depth = {picture.depth, cv::Mat1f(picture.depth.size(), 1.0F)};
      images_.push_back(std::move(image));
      plan_.images.push_back({{camera.name, 0}, 0});
    }
    plan_.method = "depth";
  }

  double psnr_of_the_view(const std::vector<cv::Mat3b>& pictures) {
    for (std::size_t k = 0; k < images_.size(); ++k) images_[k].bgr = linear_from_srgb(pictures[k]);
    PlannedEye eye;
    eye.pinhole = images_[0].pinhole;
    // Off the middle, where the two cameras' differences do not cancel.
    eye.mu = eye.share = {0.8, 0.2};
    const Eigen::Vector3d centre =
        eye.mu[0] * images_[0].cam_from_world.centre() + eye.mu[1] * images_[1].cam_from_world.centre();
    eye.cam_from_world.R = images_[0].cam_from_world.R;
    eye.cam_from_world.t = -eye.cam_from_world.R * centre;
    plan_.scene_distance = (eye.cam_from_world * scene_.centre()).norm();
    const cv::Mat3b drawn = srgb8_from_linear(render_eye(images_, plan_, eye).bgr);
    return cv::PSNR(drawn, scene_.render(eye.pinhole, eye.cam_from_world, 0).bgr);
  }

  synthetic::Scene scene_{{.moving = false}};
  std::vector<synthetic::SceneCamera> cameras_ = synthetic::arc_cameras(2, 1, 480, 270, 8, 0);
  std::vector<SourceImage> images_;
  std::vector<cv::Mat3b> filmed_;
  FramePlan plan_;
};

TEST_F(ViewBetweenTwoCameras, IsNearerToTheTruthInTheSharedLook) {
  const double as_filmed_db = psnr_of_the_view(filmed_);
  std::vector<PosedColourPicture> pictures;
  for (std::size_t k = 0; k < images_.size(); ++k)
    pictures.push_back({static_cast<int>(k), filmed_[k], {}, images_[k].pinhole, images_[k].cam_from_world});
  const auto solution = solve_colours(colour_samples(pictures), 2);
  ASSERT_TRUE(solution.is_significant());
  std::vector<cv::Mat3b> matched;
  for (std::size_t k = 0; k < images_.size(); ++k) matched.push_back(in_shared_look(filmed_[k], solution.colours[k]));
  const double matched_db = psnr_of_the_view(matched);
  RecordProperty("as_filmed_db", fmt::format("{:.2f}", as_filmed_db));
  RecordProperty("matched_db", fmt::format("{:.2f}", matched_db));
  EXPECT_GT(matched_db, as_filmed_db + 2) << "as filmed " << as_filmed_db;
}

}  // namespace
}  // namespace vantage
