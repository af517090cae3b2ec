/// Moving points in front of cameras on an arc, all exact but for noise; clocks and poses start wrong.
#include "jobs/align/joint_adjustment.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <random>

namespace vantage::align {
namespace {

constexpr double kFrameS = 1.0 / 30;

struct Asked {
  int num_cameras = 4, num_frames = 30, num_moving = 30;
  double noise_px = 0.3, bias_px = 0.1;
  double wrong_share = 0;  ///< of the points, one track is another point's
  bool level = false;      ///< cameras at one height, motion along it
  bool known_cameras = true;
  double pose_error_deg = 0;  ///< about each axis; and the same angle's arc for the centre
  double start_error_frames = 0.2;
  unsigned seed = 1;
};

struct Case {
  JointScene scene;  ///< as given to the adjustment
  std::vector<JointCamera> truth;
};

class Maker {
 public:
  explicit Maker(const Asked& asked) : asked_(asked), random_(asked.seed) {}

  Case make() {
    for (int i = 0; i < asked_.num_cameras; ++i) out_.truth.push_back(camera(i));
    out_.scene.cameras = out_.truth;
    out_.scene.known_cameras = asked_.known_cameras;
    for (std::size_t i = 1; i < out_.truth.size(); ++i) spoil(out_.scene.cameras[i], i);
    for (int k = 0; k < asked_.num_moving; ++k)
      out_.scene.moving.push_back(point(k < asked_.wrong_share * asked_.num_moving));
    for (int k = 0; k < 120 && !asked_.known_cameras; ++k) out_.scene.still.push_back(still_point());
    return std::move(out_);
  }

 private:
  double uniform() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  double normal() { return std::normal_distribution<double>(0, 1)(random_); }
  Eigen::Vector3d box(double x, double y, double z) {
    const double a = uniform(), b = uniform(), c = uniform();
    return {a * x, b * y, c * z};
  }
  Eigen::Vector2d noise(double std) {
    const double x = normal(), y = normal();
    return {std * x, std * y};
  }

  JointCamera camera(int i) {
    const double angle = 0.25 * (i - 0.5 * (asked_.num_cameras - 1));
    const Eigen::Vector3d centre(5 * std::sin(angle), asked_.level ? 0 : (i % 2 == 0 ? -0.6 : 0.6),
                                 -5 * std::cos(angle));
    const Eigen::Vector3d front = -centre.normalized(), right = Eigen::Vector3d::UnitY().cross(front).normalized();
    JointCamera out{.lens = {640, 360, 600, 600, 320, 180}, .cam_from_world = {}, .clock = {}};
    out.cam_from_world.R << right.transpose(), front.cross(right).transpose(), front.transpose();
    out.cam_from_world.t = -out.cam_from_world.R * centre;
    out.clock = {"cam" + std::to_string(i), i == 0 ? 0 : 0.05 * uniform(), 1,
                 i == 0 ? 0 : asked_.start_error_frames * kFrameS};
    out.frame_s = kFrameS;
    out.middle_s = 0.5 * kFrameS * asked_.num_frames;
    return out;
  }

  void spoil(JointCamera& camera, std::size_t i) {
    camera.clock.offset_s += (i % 2 == 0 ? 1 : -1) * asked_.start_error_frames * kFrameS;
    const double error = asked_.pose_error_deg * M_PI / 180;
    if (error == 0) return;
    const Eigen::Vector3d turn = error * Eigen::Vector3d(normal(), normal(), normal());
    camera.cam_from_world.R =
        Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * camera.cam_from_world.R;
    camera.cam_from_world.t += 5 * error * Eigen::Vector3d(normal(), normal(), normal());
  }

  MovingTrack track(std::size_t i, const std::function<Eigen::Vector3d(double)>& where) {
    const JointCamera& camera = out_.truth[i];
    const Eigen::Vector2d bias = noise(asked_.bias_px);
    MovingTrack track{.camera = i, .times_s = {}, .px = {}};
    for (int f = 0; f < asked_.num_frames; ++f) {
      track.times_s.push_back(f * kFrameS);
      const Eigen::Vector3d X = where(camera.clock.shot_time_s(track.times_s.back()));
      track.px.push_back(camera.lens.project(camera.cam_from_world * X) + bias + noise(asked_.noise_px));
    }
    return track;
  }

  std::function<Eigen::Vector3d(double)> motion() {
    const double level = asked_.level ? 0 : 1;
    const Eigen::Vector3d p = box(0.8, asked_.level ? 0 : 0.5, 0.8), v = box(0.8, 0.8 * level, 0.8),
                          a = box(0.15, 0.15 * level, 0.15);
    const double w = 4 + 2 * uniform(), phase = 3 * uniform();
    return [=](double t) -> Eigen::Vector3d { return p + v * (t - 0.7) + a * std::sin(w * t + phase); };
  }

  MovingPoint point(bool wrong) {
    const auto path = motion(), other = motion();
    MovingPoint out;
    for (std::size_t i = 0; i < out_.truth.size(); ++i) out.tracks.push_back(track(i, wrong && i == 1 ? other : path));
    return out;
  }

  StillPoint still_point() {
    StillPoint out{.position = box(2, 1.2, 1.5), .seen = {}};
    for (std::size_t i = 0; i < out_.truth.size(); ++i)
      out.seen.push_back({i, out_.truth[i].lens.project(out_.truth[i].cam_from_world * out.position) + noise(0.3)});
    return out;
  }

  Asked asked_;
  std::mt19937 random_;
  Case out_;
};

/// Frames, at the middle of the footage.
double clock_error(const Case& c, const JointCamera& camera, std::size_t i) {
  const double t = camera.middle_s;
  return (camera.clock.shot_time_s(t) - c.truth[i].clock.shot_time_s(t)) / kFrameS;
}

double rotation_error_deg(const Case& c, const JointCamera& camera, std::size_t i) {
  const Eigen::Matrix3d R = camera.cam_from_world.R * c.truth[i].cam_from_world.R.transpose();
  return Eigen::AngleAxisd(R).angle() * 180 / M_PI;
}

TEST(JointAdjustment, ClocksComeBackAndAreAsSureAsTheySay) {
  int num = 0, within = 0;
  double squares = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const Case c = Maker({.num_moving = 24, .seed = seed}).make();
    const JointResult result = adjust_jointly(c.scene);
    EXPECT_TRUE(result.accepted) << result.verdict;
    for (std::size_t i = 1; i < c.truth.size(); ++i) {
      const double error = clock_error(c, result.cameras[i], i);
      squares += error * error;
      within += std::abs(error) * kFrameS < result.cameras[i].clock.offset_std_s ? 1 : 0;
      ++num;
    }
    EXPECT_EQ(result.cameras[0].clock.offset_std_s, 0);
  }
  EXPECT_LT(std::sqrt(squares / num), 0.01);
  EXPECT_NEAR(static_cast<double>(within) / num, 0.68, 0.13);
}

TEST(JointAdjustment, PosesImproveWithClocks) {
  const Case c = Maker({.num_cameras = 5, .num_moving = 40, .known_cameras = false, .pose_error_deg = 0.15}).make();
  const JointResult result = adjust_jointly(c.scene);
  EXPECT_TRUE(result.accepted) << result.verdict;
  EXPECT_LT(result.error_after_px, 0.9 * result.error_before_px);
  double before = 0, after = 0;
  for (std::size_t i = 1; i < c.truth.size(); ++i) {
    EXPECT_LT(std::abs(clock_error(c, result.cameras[i], i)), 0.02);
    before += rotation_error_deg(c, c.scene.cameras[i], i);
    after += rotation_error_deg(c, result.cameras[i], i);
  }
  EXPECT_LT(after, 0.4 * before);
}

TEST(JointAdjustment, KnownCamerasStayUntouched) {
  const Case c = Maker({.num_moving = 10}).make();
  const JointResult result = adjust_jointly(c.scene);
  for (std::size_t i = 0; i < c.truth.size(); ++i) {
    EXPECT_TRUE(result.cameras[i].cam_from_world.R.isApprox(c.truth[i].cam_from_world.R, 1e-12));
    EXPECT_EQ(result.cameras[i].cam_from_world.t, c.truth[i].cam_from_world.t);
    EXPECT_EQ(result.cameras[i].lens.fx, c.truth[i].lens.fx);
  }
}

TEST(JointAdjustment, WrongTracksDoNoHarm) {
  const Case c = Maker({.num_moving = 40, .wrong_share = 0.2}).make();
  const JointResult result = adjust_jointly(c.scene);
  EXPECT_TRUE(result.accepted) << result.verdict;
  EXPECT_LE(result.num_moving, 36);  // most of the eight
  for (std::size_t i = 1; i < c.truth.size(); ++i) EXPECT_LT(std::abs(clock_error(c, result.cameras[i], i)), 0.02);
}

/// With every point on a plane through both cameras, another time of one is another way of the point: only what noise
/// adds to motion seems to tell.
TEST(JointAdjustment, LevelMotionBeforeTwoLevelCamerasIsNotTold) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const Case c = Maker({.num_cameras = 2, .bias_px = 0, .level = true, .seed = seed}).make();
    EXPECT_GT(adjust_jointly(c.scene).cameras[1].clock.offset_std_s, 0.2 * kFrameS) << "seed " << seed;
  }
}

TEST(JointAdjustment, TooFewPointsSaySo) {
  const Case c = Maker({.num_moving = 3}).make();
  const JointResult result = adjust_jointly(c.scene);
  EXPECT_FALSE(result.accepted);
  EXPECT_NE(result.verdict.find("3 moving points"), std::string::npos) << result.verdict;
}

}  // namespace
}  // namespace vantage::align
