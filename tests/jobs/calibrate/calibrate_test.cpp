#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <random>

#include "jobs/calibrate/frame_poses.h"
#include "jobs/calibrate/gauge.h"
#include "jobs/calibrate/lens_choice.h"
#include "jobs/calibrate/plate.h"
#include "jobs/calibrate/solve.h"
#include "jobs/vision/undistort.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/synthetic_scene.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;
using synthetic::Scene;
using synthetic::SceneCamera;

double angle_deg(const Eigen::Matrix3d& R) { return Eigen::AngleAxisd(R).angle() * 180 / M_PI; }

/// Exact measurements of random points in a box by cameras on an arc, 4 from its middle.
SparseModel exact_model(const LensModel& lens, int num_points = 150, double half_side = 1) {
  SparseModel model;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> in_box(-half_side, half_side);
  for (int i = 0; i < num_points; ++i)
    model.points.push_back({{in_box(random), in_box(random), in_box(random)}, {0, 0, 0}});
  for (int c = 0; c < 5; ++c) {
    const std::string name = fmt::format("cam{}", c);
    model.lenses[name] = lens;
    RigidTransform pose;
    pose.R = (Eigen::AngleAxisd(0.25 * (c - 2), Eigen::Vector3d::UnitY()) *
              Eigen::AngleAxisd(0.1 * (c % 2), Eigen::Vector3d::UnitX()))
                 .toRotationMatrix();
    pose.t = {0, 0, 4};
    model.cam_from_world[{name, 0}] = pose;
    for (int i = 0; i < num_points; ++i) {
      const Eigen::Vector3d p = pose * model.points[static_cast<std::size_t>(i)].position;
      const cv::Point2d px = distort(lens, {p.x() / p.z(), p.y() / p.z()});
      model.observations.push_back({{name, 0}, i, {px.x, px.y}});
    }
  }
  return model;
}

void disturb(SparseModel& model) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 1);
  for (auto& point : model.points)
    point.position += 0.02 * Eigen::Vector3d(noise(random), noise(random), noise(random));
  for (auto& [image, pose] : model.cam_from_world)
    if (image.camera != "cam0") pose.t += 0.01 * Eigen::Vector3d(noise(random), noise(random), noise(random));
  for (auto& [name, lens] : model.lenses) lens.params[0] *= 1 + 0.02 * noise(random);
}

TEST(Plate, IsWhatStaysForMostOfTheTime) {
  std::vector<cv::Mat> pictures;
  for (int k = 0; k < 7; ++k) {
    cv::Mat picture(40, 60, CV_8UC3, cv::Scalar(10, 20, 30));
    picture(cv::Rect(8 * k, 10, 12, 12)).setTo(cv::Scalar(200, 200, 200));
    pictures.push_back(picture);
  }
  EXPECT_EQ(cv::norm(make_plate(pictures).bgr, cv::Mat(40, 60, CV_8UC3, cv::Scalar(10, 20, 30)), cv::NORM_INF), 0);
}

TEST(Plate, FramesAreSpreadOverTheWholeFootage) {
  EXPECT_EQ(spread_frames(100, 4), (std::vector<int>{0, 33, 66, 99}));
  EXPECT_EQ(spread_frames(3, 31), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(spread_frames(9, 1), (std::vector<int>{4}));
}

TEST(Bundle, FindsLensesAndPosesAgain) {
  const std::vector<LensModel> lenses{{"SIMPLE_PINHOLE", 640, 360, {500, 320, 180}},
                                      {"SIMPLE_RADIAL", 640, 360, {500, 320, 180, -0.1}},
                                      {"RADIAL", 640, 360, {500, 320, 180, -0.1, 0.05}},
                                      {"OPENCV", 640, 360, {500, 505, 320, 180, -0.1, 0.05, 0.002, -0.001}}};
  for (const LensModel& lens : lenses) {
    const SparseModel truth = exact_model(lens);
    SparseModel model = truth;
    disturb(model);
    for (std::size_t i = 0; i < model.observations.size(); i += 49)
      model.observations[i].px.x() += 60;  // wrong matches
    const BundleReport report = refine_bundle(model, {});
    EXPECT_LT(report.rms_px, 1e-3) << lens.model;
    EXPECT_EQ(report.num_dropped, 16) << lens.model;
    for (std::size_t i = 0; i < lens.params.size(); ++i)
      EXPECT_NEAR(model.lenses.at("cam3").params[i], lens.params[i], 1e-3 * std::max(1.0, std::abs(lens.params[i])))
          << lens.model;
    EXPECT_LT(angle_deg(model.cam_from_world.at({"cam4", 0}).R * truth.cam_from_world.at({"cam4", 0}).R.transpose()),
              0.01);
  }
}

TEST(Bundle, DropsALensThatDoesNothing) {
  SparseModel idle = exact_model({"SIMPLE_RADIAL", 640, 360, {500, 320, 180, 0}}, 600, 1.6);
  for (auto& [name, lens] : idle.lenses) lens.params[3] = -0.002;
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.3);
  for (auto& o : idle.observations) o.px += Eigen::Vector2d(noise(random), noise(random));
  drop_idle_lenses(idle, {}, refine_bundle(idle, {}));
  EXPECT_EQ(idle.lenses.at("cam2").model, "SIMPLE_PINHOLE");
  SparseModel real = exact_model({"SIMPLE_RADIAL", 640, 360, {500, 320, 180, -0.05}}, 600, 1.6);
  drop_idle_lenses(real, {}, refine_bundle(real, {}));
  EXPECT_EQ(real.lenses.at("cam2").model, "SIMPLE_RADIAL");
}

TEST(Gauge, PutsThePointsAtTheOriginUprightAndInUnitDistance) {
  const SparseModel model = exact_model({"SIMPLE_PINHOLE", 640, 360, {500, 320, 180}});
  Calibration calibration;
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (const auto& p : model.points) {
    SparsePoint moved;
    moved.position = 7 * (turn * p.position) + Eigen::Vector3d(5, 6, 7);
    calibration.points.push_back(moved);
  }
  for (const auto& [image, pose] : model.cam_from_world) {
    const Eigen::Vector3d centre = 7 * (turn * pose.centre()) + Eigen::Vector3d(5, 6, 7);
    calibration.cam_from_world[image] = {pose.R * turn.transpose(), -pose.R * turn.transpose() * centre};
  }
  normalise_world(calibration);
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  for (const auto& [image, pose] : calibration.cam_from_world) {
    EXPECT_NEAR(pose.centre().norm(), 1, 0.1);
    down += pose.R.row(1).transpose();
    // The same picture as before: similarity transforms show in none.
    const auto& before = model.cam_from_world.at(image);
    const Eigen::Vector3d now = pose * calibration.points[3].position, then = before * model.points[3].position;
    EXPECT_TRUE((now / now.z()).isApprox(then / then.z(), 1e-9));
  }
  EXPECT_TRUE(down.normalized().isApprox(Eigen::Vector3d::UnitY(), 1e-9));
}

/// Cameras that look down a little on level ground at y = 1.2 with a box of points on it.
Calibration above_ground() {
  Calibration calibration;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> wide(-2, 2), box(-0.4, 0.4), noise(-0.002, 0.002);
  const auto add_point = [&](const Eigen::Vector3d& position) {
    calibration.points.emplace_back();
    calibration.points.back().position = position;
  };
  for (int i = 0; i < 200; ++i) add_point({wide(random), 1.2 + noise(random), 4 + wide(random)});
  for (int i = 0; i < 150; ++i) add_point({box(random), 0.7 + box(random), 4 + box(random)});
  for (int c = 0; c < 3; ++c) {
    RigidTransform& pose = calibration.cam_from_world[{fmt::format("cam{}", c), 0}];
    pose.R =
        (Eigen::AngleAxisd(0.25, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(0.2 * (c - 1), Eigen::Vector3d::UnitY()))
            .toRotationMatrix();
    pose.t = -pose.R * Eigen::Vector3d(c - 1, -0.5, 0);
  }
  return calibration;
}

TEST(Gauge, LiesOnTheGroundAndTakesAKnownDistance) {
  Calibration calibration = above_ground();
  const WorldFacts facts = normalise_world(calibration, KnownDistance{"cam0", "cam2", 5});
  EXPECT_TRUE(facts.is_metric);
  const auto centre = [&](const char* name) { return calibration.pose({name, 0}).centre(); };
  EXPECT_NEAR((centre("cam0") - centre("cam2")).norm(), 5, 1e-9);
  ASSERT_TRUE(facts.ground_y);
  // 1.7 above the ground at 2.5 metres a unit, though the cameras look down.
  for (const char* name : {"cam0", "cam1", "cam2"}) EXPECT_NEAR(*facts.ground_y - centre(name).y(), 4.25, 0.02) << name;
}

TEST(Gauge, TheGroundItselfMayBeTheKnownDistance) {
  Calibration calibration = above_ground();
  const WorldFacts facts = normalise_world(calibration, KnownDistance{"cam1", "ground", 3});
  EXPECT_NEAR(*facts.ground_y - calibration.pose({"cam1", 0}).centre().y(), 3, 1e-6);
  EXPECT_THROW(normalise_world(calibration, KnownDistance{"cam7", "ground", 3}), Error);
  calibration.points.resize(10);
  EXPECT_THROW(normalise_world(calibration, KnownDistance{"cam1", "ground", 3}), Error);
}

TEST(FramePoses, FollowsAMovingCameraBetweenItsKeyFrames) {
  const Scene scene({.moving = false, .supersample = 2, .noise_sigma = 0});
  const SceneCamera still = synthetic::arc_cameras(3, 9, 320, 180)[1];
  const auto true_pose = [&](int frame) {
    RigidTransform sway = still.cam_from_world;
    sway.R = (Eigen::AngleAxisd(0.006 * frame, Eigen::Vector3d::UnitY()) *
              Eigen::AngleAxisd(0.01 * std::sin(frame), Eigen::Vector3d::UnitX()))
                 .toRotationMatrix() *
             sway.R;
    sway.t = sway.t + Eigen::Vector3d(0.02 * frame, 0.01 * frame * frame / 9, 0);
    return sway;
  };
  std::vector<synthetic::Picture> pictures;
  for (int k = 0; k < 9; ++k) pictures.push_back(scene.render(still.pinhole, true_pose(k), 0));
  SparseModel model;
  const Pinhole& p = still.pinhole;
  model.lenses["cam"] = {"PINHOLE", p.width, p.height, {p.fx, p.fy, p.cx, p.cy}};
  for (const int key : {1, 6}) {
    model.cam_from_world[{"cam", key}] = true_pose(key);
    const auto& picture = pictures[static_cast<std::size_t>(key)];
    for (int y = 20; y < 160; y += 12)
      for (int x = 20; x < 300; x += 12) {
        const Eigen::Vector2d px(x + 0.5, y + 0.5);
        const double z = picture.depth(y, x);
        if (!(z > 0)) continue;
        const RigidTransform& pose = model.cam_from_world.at({"cam", key});
        model.observations.push_back({{"cam", key}, static_cast<int>(model.points.size()), px});
        model.points.push_back({pose.R.transpose() * (z * p.ray(px) - pose.t), {0, 0, 0}});
      }
  }
  const FramePoses poses = place_frames(model, "cam", {0, 1, 2, 3, 4, 5, 6, 7, 8},
                                        [&](int k) { return cv::Mat(pictures[static_cast<std::size_t>(k)].bgr); });
  ASSERT_EQ(poses.cam_from_world.size(), 9U);
  EXPECT_EQ(poses.num_interpolated, 0);
  for (const auto& [frame, pose] : poses.cam_from_world) {
    EXPECT_LT((pose.centre() - true_pose(frame).centre()).norm(), 0.02) << frame;  // at 4 m distance
    EXPECT_LT(angle_deg(pose.R * true_pose(frame).R.transpose()), 0.2) << frame;
  }
}

/// Similarity that brings `from` onto `to` (Umeyama 1991), and what is left over.
double largest_distance(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  const Eigen::Matrix4d similarity = Eigen::umeyama(from, to);
  return ((similarity.topLeftCorner<3, 3>() * from).colwise() + similarity.topRightCorner<3, 1>() - to)
      .colwise()
      .norm()
      .maxCoeff();
}

class Colmap : public testing::Test {
 protected:
  void SetUp() override {
    work_ = fs::path(testing::TempDir()) / fmt::format("calibrate-{}", getpid());
    fs::create_directories(work_);
  }
  void TearDown() override { fs::remove_all(work_); }
  EstimatedCalibration estimate(const std::vector<FilmedCamera>& cameras, const FrameReader& read) const {
    const Footage footage{.frame = read,
                          .counts = [](const std::string&, const std::vector<int>&) { return cv::Mat(); }};
    return estimate_calibration(cameras, footage, {}, work_, 1, [](double, const std::string&) {});
  }
  static FilmedCamera filmed(const SceneCamera& camera) {
    FilmedCamera out;
    out.table = {.camera = camera.name,
                 .width = camera.pinhole.width,
                 .height = camera.pinhole.height,
                 .fps = camera.fps,
                 .pts_s = std::vector<double>(static_cast<std::size_t>(camera.num_frames))};
    return out;
  }
  fs::path work_;
};

TEST_F(Colmap, RegistersAllCamerasOfAnArc) {
  const Scene scene({.moving = true, .supersample = 2, .noise_sigma = 0});
  const auto arc = synthetic::arc_cameras(5, 3, 400, 225);
  std::vector<FilmedCamera> cameras;
  for (const auto& camera : arc) cameras.push_back(filmed(camera));
  const FrameReader read = [&](const ImageId& image) -> cv::Mat {
    const auto& camera = *std::find_if(arc.begin(), arc.end(), [&](const auto& c) { return c.name == image.camera; });
    return scene.render(camera.pinhole, camera.cam_from_world, camera.time_s(image.frame)).bgr;
  };
  const auto estimated = estimate(cameras, read);
  EXPECT_EQ(estimated.calibration.cam_from_world.size(), 15U);
  EXPECT_TRUE(estimated.warnings.empty());
  const auto again = estimate(cameras, read);
  for (const auto& [image, pose] : estimated.calibration.cam_from_world) {
    EXPECT_EQ(again.calibration.pose(image).R, pose.R) << "the same pictures give the same poses, to the last bit";
    EXPECT_EQ(again.calibration.pose(image).t, pose.t);
  }
  EXPECT_LT(estimated.bundle.mean_px, 0.7);
  Eigen::Matrix3Xd found(3, 5), truth(3, 5);
  for (int i = 0; i < 5; ++i) {
    const auto& camera = arc[static_cast<std::size_t>(i)];
    ASSERT_TRUE(estimated.calibration.cameras.contains(camera.name));
    found.col(i) = estimated.calibration.pose({camera.name, 0}).centre();
    truth.col(i) = camera.cam_from_world.centre();
    EXPECT_EQ(estimated.calibration.pose({camera.name, 0}).t, estimated.calibration.pose({camera.name, 2}).t);
    EXPECT_NEAR(estimated.calibration.camera(camera.name).pinhole.fx / camera.pinhole.fx, 1, 0.02);
  }
  EXPECT_LT(largest_distance(found, truth), 0.01 * 4);
  ASSERT_EQ(estimated.observations.size(), static_cast<std::size_t>(estimated.bundle.num_observations));
  for (const auto& o : estimated.observations) {
    EXPECT_FALSE(o.frame.has_value());
    const auto& camera = estimated.calibration.camera(o.camera);
    const Eigen::Vector3d p = estimated.calibration.pose({o.camera, 0}) *
                              estimated.calibration.points[static_cast<std::size_t>(o.point)].position;
    const cv::Point2d px = camera.filmed ? distort(*camera.filmed, {p.x() / p.z(), p.y() / p.z()})
                                         : cv::Point2d(camera.pinhole.project(p).x(), camera.pinhole.project(p).y());
    EXPECT_LE(std::hypot(px.x - o.px.x(), px.y - o.px.y()), 4.5);
  }
}

TEST(Observations, SurviveTheirFile) {
  const fs::path file = fs::path(testing::TempDir()) / fmt::format("observations-{}.txt", getpid());
  write_observations(file, {{0, "left", {}, {12.25, 7.5}}, {41, "right", 17, {639.125, 0.0625}}});
  const auto back = read_observations(file);
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[0].point, 0);
  EXPECT_FALSE(back[0].frame.has_value());
  EXPECT_EQ(back[1].camera, "right");
  EXPECT_EQ(back[1].frame, 17);
  EXPECT_EQ(back[1].px, Eigen::Vector2d(639.125, 0.0625));
  write_file_atomically(file, "# heading\n3 left - 1 2\n0 left - 1 2\n");
  try {
    read_observations(file);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find(":3: found '0 left - 1 2'"), std::string::npos) << e.what();
  }
  fs::remove(file);
}

TEST_F(Colmap, SaysWhenCamerasSeeNothingInCommon) {
  std::vector<FilmedCamera> cameras(2);
  cameras[0].table = {.camera = "left", .width = 160, .height = 120, .fps = 1, .pts_s = {0}};
  cameras[1].table = {.camera = "right", .width = 160, .height = 120, .fps = 1, .pts_s = {0}};
  try {
    estimate(cameras, [](const ImageId& image) {
      cv::Mat noise(120, 160, CV_8UC3);
      cv::RNG(image.camera == "left" ? 1 : 2).fill(noise, cv::RNG::UNIFORM, 0, 255);
      return noise;
    });
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::BadInput);
    EXPECT_NE(std::string(e.what()).find("cameras see nothing in common: 0 of 2 could be placed"), std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace vantage
