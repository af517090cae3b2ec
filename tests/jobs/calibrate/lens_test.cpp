#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "jobs/calibrate/certainty.h"
#include "jobs/calibrate/lens_choice.h"
#include "jobs/vision/undistort.h"

namespace vantage {
namespace {

struct Rig {
  int num_cameras = 8;
  double focal_step_px = 0;  ///< between neighbours
  Eigen::Vector2d centre_px{320, 180};
  double noise_px = 0.3;
  unsigned seed = 1;
};

/// Points in a box, seen by cameras around it at several heights, some turned about their axis.
SparseModel photographed(const Rig& rig) {
  SparseModel model;
  std::mt19937 random(rig.seed);
  std::uniform_real_distribution<double> in_box(-1.2, 1.2);
  std::normal_distribution<double> noise(0, rig.noise_px);
  for (int i = 0; i < 250; ++i) model.points.push_back({{in_box(random), in_box(random), in_box(random)}, {0, 0, 0}});
  for (int c = 0; c < rig.num_cameras; ++c) {
    const ImageId image{fmt::format("cam{}", c), 0};
    const double f = 480 + rig.focal_step_px * c;
    model.lenses[image.camera] = {"SIMPLE_PINHOLE", 640, 360, {f, rig.centre_px.x(), rig.centre_px.y()}};
    RigidTransform pose;
    pose.R = (Eigen::AngleAxisd(c % 3 == 1 ? 1.4 : 0, Eigen::Vector3d::UnitZ()) *
              Eigen::AngleAxisd(0.25 * (c % 4) - 0.3, Eigen::Vector3d::UnitX()) *
              Eigen::AngleAxisd(0.3 * c, Eigen::Vector3d::UnitY()))
                 .toRotationMatrix();
    pose.t = {0.1 * (c % 2), 0, 4 + 0.3 * (c % 3)};
    model.cam_from_world[image] = pose;
    for (int i = 0; i < 250; ++i) {
      const Eigen::Vector3d p = pose * model.points[static_cast<std::size_t>(i)].position;
      const cv::Point2d px = distort(model.lenses[image.camera], {p.x() / p.z(), p.y() / p.z()});
      if (px.x < 0 || px.y < 0 || px.x > 640 || px.y > 360) continue;
      model.observations.push_back({.image = image, .point = i, .px = {px.x + noise(random), px.y + noise(random)}});
    }
  }
  return model;
}

/// What a mapper hands over: principal points at the pictures' centres.
SparseModel as_mapped(SparseModel model) {
  for (auto& [name, lens] : model.lenses) {
    lens.params[1] = 320;
    lens.params[2] = 180;
  }
  return model;
}

TEST(LensChoice, FindsThePrincipalPointOfOneLensThatTookAllPictures) {
  SparseModel model = as_mapped(photographed({.centre_px = {331, 174}}));
  const BundleReport report = choose_lenses(model, {});
  EXPECT_TRUE(report.lens.shared);
  EXPECT_TRUE(report.lens.centre);
  for (const auto& [name, lens] : model.lenses) EXPECT_EQ(lens.params, model.lenses.begin()->second.params);
  const auto& p = model.lenses.begin()->second.params;
  const bool two_focals = p.size() == 4;
  EXPECT_NEAR(p[0], 480, 0.5);
  EXPECT_NEAR(p[two_focals ? 2 : 1], 331, 0.7);
  EXPECT_NEAR(p[two_focals ? 3 : 2], 174, 0.7);
}

TEST(LensChoice, KeepsLensesApartThatDiffer) {
  SparseModel model = as_mapped(photographed({.focal_step_px = 4}));
  const BundleReport report = choose_lenses(model, {});
  EXPECT_FALSE(report.lens.shared);
  EXPECT_NEAR(model.lenses.at("cam0").params[0], 480, 2);
  EXPECT_NEAR(model.lenses.at("cam7").params[0], 508, 2);
}

TEST(LensChoice, LeavesThePrincipalPointWhereNothingMovesIt) {
  for (const double focal_step_px : {0.0, 4.0}) {
    SparseModel model = photographed({.focal_step_px = focal_step_px});
    EXPECT_FALSE(choose_lenses(model, {}).lens.centre);
    EXPECT_EQ(model.lenses.at("cam3").params[1], 320);
  }
}

/// The similarity that brings the estimated centres onto the true ones, and what is left over.
struct Leftover {
  double centre = 0, rotation_deg = 0, focal_percent = 0;
};
std::map<ImageId, Leftover> compare(const SparseModel& found, const SparseModel& truth) {
  const auto num = static_cast<Eigen::Index>(truth.cam_from_world.size());
  Eigen::Matrix3Xd from(3, num), to(3, num);
  Eigen::Index i = 0;
  for (const auto& [image, pose] : truth.cam_from_world) {
    from.col(i) = found.cam_from_world.at(image).centre();
    to.col(i++) = pose.centre();
  }
  const Eigen::Matrix4d similarity = Eigen::umeyama(from, to);
  const double scale = similarity.topLeftCorner<3, 3>().col(0).norm();
  const Eigen::Matrix3d R = similarity.topLeftCorner<3, 3>() / scale;
  std::map<ImageId, Leftover> out;
  for (const auto& [image, pose] : truth.cam_from_world) {
    const RigidTransform& f = found.cam_from_world.at(image);
    const Eigen::Vector3d centre = similarity.topLeftCorner<3, 3>() * f.centre() + similarity.topRightCorner<3, 1>();
    out[image] = {
        .centre = (centre - pose.centre()).norm(),
        .rotation_deg =
            Eigen::AngleAxisd(Eigen::Matrix3d(f.R * R.transpose() * pose.R.transpose())).angle() * 180 / M_PI,
        .focal_percent =
            100 * std::abs(found.lenses.at(image.camera).params[0] / truth.lenses.at(image.camera).params[0] - 1)};
  }
  return out;
}

TEST(Certainty, TwoThirdsOfTheErrorsAreWithinOneStandardDeviation) {
  int num = 0, centre = 0, rotation = 0, focal = 0;
  double centre_ratio2 = 0, rotation_ratio2 = 0, focal_ratio2 = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const Rig rig{.num_cameras = 6, .focal_step_px = 3, .seed = seed};
    const SparseModel truth = photographed(rig);
    SparseModel model = truth;
    const BundleReport report = refine_bundle(model, {});
    const auto certainty = certainty_of(model, report.lens);
    const auto errors = compare(model, truth);
    ASSERT_EQ(certainty.size(), errors.size());
    for (const auto& [image, error] : errors) {
      const CameraCertainty& c = certainty.at(image);
      ++num;
      centre += error.centre < c.centre_std;
      rotation += error.rotation_deg < c.rotation_std_deg;
      focal += error.focal_percent < c.focal_std_percent;
      centre_ratio2 += std::pow(error.centre / c.centre_std, 2);
      rotation_ratio2 += std::pow(error.rotation_deg / c.rotation_std_deg, 2);
      focal_ratio2 += std::pow(error.focal_percent / c.focal_std_percent, 2);
    }
  }
  for (const int within : {centre, rotation, focal}) {
    EXPECT_GT(within, 0.45 * num);
    EXPECT_LT(within, 0.85 * num);
  }
  for (const double ratio2 : {centre_ratio2, rotation_ratio2, focal_ratio2}) {
    EXPECT_GT(std::sqrt(ratio2 / num), 0.75);
    EXPECT_LT(std::sqrt(ratio2 / num), 1.3);
  }
}

}  // namespace
}  // namespace vantage
