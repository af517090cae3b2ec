#include "tests/support/synthetic_scene.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace vantage::synthetic {
namespace {

TEST(SyntheticScene, SurfacePointsOfARenderedPictureLieOnSurfaces) {
  const Scene scene;
  const auto cameras = arc_cameras(3, 1, 80, 45);
  const auto& c = cameras[1];
  const Picture p = scene.render(c.pinhole, c.cam_from_world, 0.3);
  for (int y = 0; y < p.depth.rows; y += 4)
    for (int x = 0; x < p.depth.cols; x += 4) {
      ASSERT_GT(p.depth(y, x), 0);
      const Eigen::Vector3d in_cam = c.pinhole.ray({x + 0.5, y + 0.5}) * static_cast<double>(p.depth(y, x));
      EXPECT_LT(scene.distance_to_surface(c.cam_from_world.R.transpose() * (in_cam - c.cam_from_world.t), 0.3), 1e-5);
    }
}

TEST(SyntheticScene, WarpingByTheExactCorrespondenceReproducesTheOtherPicture) {
  const Scene scene;
  const auto cameras = arc_cameras(2, 1, 320, 180);
  const auto &a = cameras[0], &b = cameras[1];
  const Picture pa = scene.render(a.pinhole, a.cam_from_world, 0.2),
                pb = scene.render(b.pinhole, b.cam_from_world, 0.25);
  const Truth truth = scene.correspondence(pa, a.pinhole, a.cam_from_world, 0.2, b.pinhole, b.cam_from_world, 0.25);
  cv::Mat2f map(truth.motion_px.size());
  for (int y = 0; y < map.rows; ++y)
    for (int x = 0; x < map.cols; ++x)
      map(y, x) = truth.motion_px(y, x) + cv::Vec2f(static_cast<float>(x), static_cast<float>(y));
  cv::Mat warped, difference;
  cv::remap(pb.bgr, warped, map, cv::noArray(), cv::INTER_LINEAR);
  cv::absdiff(warped, pa.bgr, difference);
  EXPECT_LT(cv::mean(difference, truth.visible)[1], 4.0);
  EXPECT_GT(cv::countNonZero(truth.visible), 0.6 * static_cast<double>(truth.visible.total()));
}

TEST(SyntheticScene, MovingThingsAreInEveryCamera) {
  const Scene scene;
  for (const auto& c : arc_cameras(6, 1, 160, 90)) {
    const Picture p = scene.render(c.pinhole, c.cam_from_world, c.time_s(0));
    EXPECT_GT(cv::countNonZero(p.id >= kFirstMovingId), 100) << c.name;
    if (const char* folder = std::getenv("VANTAGE_TEST_PICTURES"))
      cv::imwrite(std::string(folder) + "/" + c.name + ".png", p.bgr);
  }
}

}  // namespace
}  // namespace vantage::synthetic
