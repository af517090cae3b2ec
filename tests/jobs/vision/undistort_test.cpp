#include "jobs/vision/undistort.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vantage {
namespace {

const std::vector<LensModel> kLenses{
    {"SIMPLE_RADIAL", 160, 90, {130, 80, 45, -0.2}},
    {"SIMPLE_RADIAL", 160, 90, {130, 83, 41, 0.15}},
    {"RADIAL", 160, 90, {130, 80, 45, -0.2, 0.05}},
    {"OPENCV", 160, 90, {131, 129, 78, 46, -0.21, 0.06, 0.002, -0.003}},
    {"FULL_OPENCV", 160, 90, {131, 129, 78, 46, -0.1, 0.05, 0.001, -0.002, 0.01, 0.08, 0.02, 0.001}},
};

CameraModel camera_of(const LensModel& lens) {
  return {.name = "cam0", .id = 1, .pinhole = undistorted_pinhole(lens), .filmed = lens};
}

/// A smooth picture as a function of the direction of sight, so that truth is known in any lens.
double brightness(const cv::Point2d& normalised) {
  return 128 + 60 * std::sin(9 * normalised.x) + 50 * std::cos(11 * normalised.y);
}

/// Direction that a lens shows at a pixel: inverse of distort() by Newton's method with numeric derivatives.
cv::Point2d undistort(const LensModel& lens, const cv::Point2d& px) {
  cv::Point2d n((px.x - lens.width / 2.0) / lens.params[0], (px.y - lens.height / 2.0) / lens.params[0]);
  for (int i = 0; i < 30; ++i) {
    const double h = 1e-6;
    const cv::Point2d f = distort(lens, n) - px;
    const cv::Point2d dx = (distort(lens, n + cv::Point2d(h, 0)) - px - f) / h,
                      dy = (distort(lens, n + cv::Point2d(0, h)) - px - f) / h;
    const double det = dx.x * dy.y - dx.y * dy.x;
    n -= cv::Point2d(f.x * dy.y - f.y * dy.x, f.y * dx.x - f.x * dx.y) / det;
  }
  return n;
}

cv::Mat filmed_picture(const LensModel& lens) {
  cv::Mat out(lens.height, lens.width, CV_8UC3);
  for (int y = 0; y < lens.height; ++y)
    for (int x = 0; x < lens.width; ++x)
      out.at<cv::Vec3b>(y, x) =
          cv::Vec3b::all(cv::saturate_cast<uchar>(brightness(undistort(lens, {x + 0.5, y + 0.5}))));
  return out;
}

TEST(Undistorter, ShowsEveryRayWhereThePinholePutsIt) {
  for (const LensModel& lens : kLenses) {
    const CameraModel camera = camera_of(lens);
    const cv::Mat got = Undistorter(camera).apply(filmed_picture(lens));
    ASSERT_EQ(got.size(), cv::Size(lens.width, lens.height));
    for (int y = 0; y < got.rows; ++y)
      for (int x = 0; x < got.cols; ++x) {
        const Eigen::Vector3d ray = camera.pinhole.ray({x + 0.5, y + 0.5});
        // Half a pixel of displacement would show as up to 3 levels in the middle and as black on the rim.
        EXPECT_NEAR(got.at<cv::Vec3b>(y, x)[0], brightness({ray.x(), ray.y()}), 2.6)
            << lens.model << " at " << x << ", " << y;
      }
  }
}

TEST(Undistorter, KeepsHalfPixelCentres) {
  // A lens that only shifts: one pixel to the right and two down, exactly.
  const LensModel lens{"PINHOLE", 20, 10, {100, 100, 11, 7}};
  CameraModel camera{.name = "cam0", .id = 1, .pinhole = {20, 10, 100, 100, 10, 5}, .filmed = lens};
  cv::Mat filmed(10, 20, CV_8UC3, cv::Scalar::all(0));
  filmed.at<cv::Vec3b>(6, 12) = cv::Vec3b::all(200);
  const cv::Mat got = Undistorter(camera).apply(filmed);
  EXPECT_EQ(got.at<cv::Vec3b>(4, 11)[0], 200);
  EXPECT_EQ(cv::countNonZero(got.reshape(1)), 3);
}

TEST(Undistorter, IsFreeWithoutALens) {
  const LensModel pinhole{"PINHOLE", 160, 90, {131, 129, 78, 46}};
  EXPECT_TRUE(Undistorter(camera_of(pinhole)).is_identity());
  CameraModel plain = camera_of(pinhole);
  plain.filmed.reset();
  EXPECT_TRUE(Undistorter(plain).is_identity());
  EXPECT_FALSE(Undistorter(camera_of(kLenses[0])).is_identity());
}

TEST(UndistortedPinhole, IsTheWidestViewWithoutEmptyRim) {
  for (const LensModel& lens : kLenses) {
    const Pinhole p = undistorted_pinhole(lens);
    double nearest = 1e9;
    for (int i = 0; i <= 200; ++i)
      for (const Eigen::Vector2d& px :
           {Eigen::Vector2d(p.width * i / 200.0, 0), Eigen::Vector2d(p.width * i / 200.0, p.height),
            Eigen::Vector2d(0, p.height * i / 200.0), Eigen::Vector2d(p.width, p.height * i / 200.0)}) {
        const Eigen::Vector3d ray = p.ray(px);
        const cv::Point2d filmed = distort(lens, {ray.x(), ray.y()});
        nearest = std::min({nearest, filmed.x, filmed.y, lens.width - filmed.x, lens.height - filmed.y});
      }
    EXPECT_GT(nearest, -0.05) << lens.model;
    EXPECT_LT(nearest, 0.05) << lens.model << ": could be wider";
  }
}

TEST(UndistortedPinhole, StaysInsideWhereThePolynomialTurnsBack) {
  const LensModel wide{"SIMPLE_RADIAL", 160, 90, {80, 80, 45, -0.3}};
  const Pinhole p = undistorted_pinhole(wide);
  const double corner = p.ray({0, 0}).head<2>().norm();
  EXPECT_LT(corner, std::sqrt(1 / (3 * 0.3)));
}

TEST(Distort, AgreesWithTheFormulaOfEachModel) {
  const cv::Point2d n(0.3, -0.2);
  const double r2 = 0.13;
  const auto radial = distort({"RADIAL", 160, 90, {130, 80, 45, -0.2, 0.05}}, n);
  const double s = 1 - 0.2 * r2 + 0.05 * r2 * r2;
  EXPECT_NEAR(radial.x, 130 * 0.3 * s + 80, 1e-12);
  EXPECT_NEAR(radial.y, 130 * -0.2 * s + 45, 1e-12);
  const auto opencv = distort({"OPENCV", 160, 90, {130, 120, 80, 45, -0.2, 0.05, 0.01, 0.02}}, n);
  EXPECT_NEAR(opencv.x, 130 * (0.3 * s + 2 * 0.01 * 0.3 * -0.2 + 0.02 * (r2 + 2 * 0.09)) + 80, 1e-12);
  EXPECT_NEAR(opencv.y, 120 * (-0.2 * s + 2 * 0.02 * 0.3 * -0.2 + 0.01 * (r2 + 2 * 0.04)) + 45, 1e-12);
}

}  // namespace
}  // namespace vantage
