#include "jobs/track/follow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "jobs/track/looks.h"
#include "jobs/track/track_job.h"
#include "tests/support/synthetic_scene.h"

namespace vantage::track {
namespace {

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + std::ssize(v) / 2, v.end());
  return v[v.size() / 2];
}

/// The ray-traced scene as one static camera films it, rendered once for all tests.
class FollowedScene : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    synthetic::Scene scene;
    camera_ = new synthetic::SceneCamera(synthetic::arc_cameras(3, 12, 320, 180)[1]);
    pictures_ = new std::vector<synthetic::Picture>;
    for (int f = 0; f < camera_->num_frames; ++f)
      pictures_->push_back(scene.render(camera_->pinhole, camera_->cam_from_world, camera_->time_s(f)));
    tracks_ = new std::vector<Track>(follow_features(camera_->num_frames, grey, {}));
  }
  static void TearDownTestSuite() {
    delete camera_;
    delete pictures_;
    delete tracks_;
  }
  static cv::Mat1b grey(int frame) {
    cv::Mat1b out;
    cv::cvtColor(pictures_->at(static_cast<std::size_t>(frame)).bgr, out, cv::COLOR_BGR2GRAY);
    return out;
  }
  /// Errors of the next position of every track of the kind, step by step.
  static std::vector<double> step_errors(bool moving) {
    const synthetic::Scene scene;
    std::vector<double> errors;
    for (int f = 0; f + 1 < camera_->num_frames; ++f) {
      const auto truth =
          scene.correspondence(pictures_->at(static_cast<std::size_t>(f)), camera_->pinhole, camera_->cam_from_world,
                               camera_->time_s(f), camera_->pinhole, camera_->cam_from_world, camera_->time_s(f + 1));
      for (const Track& track : *tracks_) {
        if (track.moving != moving || f < track.first_frame || f >= track.last_frame()) continue;
        const auto k = static_cast<std::size_t>(f - track.first_frame);
        const int x = static_cast<int>(track.px[k].x()), y = static_cast<int>(track.px[k].y());
        if (!truth.visible(y, x)) continue;
        const cv::Vec2f motion = truth.motion_px(y, x);
        const Eigen::Vector2f error = track.px[k + 1] - track.px[k] - Eigen::Vector2f(motion[0], motion[1]);
        errors.push_back(error.norm());
      }
    }
    return errors;
  }
  static synthetic::SceneCamera* camera_;
  static std::vector<synthetic::Picture>* pictures_;
  static std::vector<Track>* tracks_;
};
synthetic::SceneCamera* FollowedScene::camera_ = nullptr;
std::vector<synthetic::Picture>* FollowedScene::pictures_ = nullptr;
std::vector<Track>* FollowedScene::tracks_ = nullptr;

TEST_F(FollowedScene, MovingPointsFollowTheTruth) {
  const auto errors = step_errors(true);
  ASSERT_GT(errors.size(), 200U);
  EXPECT_LT(median(errors), 0.3);
}

TEST_F(FollowedScene, StaticPointsStay) {
  const auto errors = step_errors(false);
  ASSERT_GT(errors.size(), 500U);
  EXPECT_LT(median(errors), 0.1);
}

TEST_F(FollowedScene, PointsAreCalledMovingWhereThingsMove) {
  int right = 0, all = 0;
  for (const Track& track : *tracks_) {
    if (!track.moving) continue;
    const auto& picture = pictures_->at(static_cast<std::size_t>(track.first_frame));
    const int x = static_cast<int>(track.px[0].x()), y = static_cast<int>(track.px[0].y());
    cv::Rect around(cv::Rect(x - 3, y - 3, 7, 7) & cv::Rect(0, 0, picture.id.cols, picture.id.rows));
    double highest_id = 0;
    cv::minMaxLoc(picture.id(around), nullptr, &highest_id);
    right += highest_id >= synthetic::kFirstMovingId ? 1 : 0;
    ++all;
  }
  ASSERT_GT(all, 30);
  EXPECT_GT(right, 0.85 * all);
}

TEST_F(FollowedScene, EveryMovingTrackAndNoOtherIsDescribed) {
  std::vector<Track> tracks = *tracks_;
  describe_moving_tracks(tracks, camera_->num_frames, grey);
  for (const Track& track : tracks) {
    EXPECT_EQ(track.looks.empty(), !track.moving);
    for (const TrackLook& look : track.looks) {
      EXPECT_GE(look.frame, track.first_frame);
      EXPECT_LE(look.frame, track.last_frame());
    }
  }
}

TEST_F(FollowedScene, SameFramesGiveSameTracks) {
  const auto again = follow_features(camera_->num_frames, grey, {});
  ASSERT_EQ(again.size(), tracks_->size());
  for (std::size_t i = 0; i < again.size(); ++i) EXPECT_EQ(again[i].px, (*tracks_)[i].px);
}

/// A textured plane seen by a panning camera, with a patch that moves on it.
TEST(Follow, PanningCameraTellsWhatMovesFromWhatStays) {
  cv::Mat1b wall(260, 420), thing(60, 60);
  cv::RNG random(5);
  random.fill(wall, cv::RNG::UNIFORM, 0, 255);
  random.fill(thing, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(wall, wall, {0, 0}, 1.5);
  cv::GaussianBlur(thing, thing, {0, 0}, 1.5);
  const GreyFrames grey = [&](int frame) {
    cv::Mat1b world = wall.clone();
    thing.copyTo(world(cv::Rect(120, 60 + 3 * frame, 60, 60)));
    return cv::Mat1b(world(cv::Rect(5 + 4 * frame, 20, 320, 200)).clone());
  };
  FollowOptions options;
  options.camera_moves = true;
  const auto tracks = follow_features(12, grey, options);
  int moving = 0, moving_on_thing = 0, still = 0;
  for (const Track& t : tracks) {
    const double x = double{t.px[0].x()} + 5 + 4 * t.first_frame, y = double{t.px[0].y()} - 40 - 3 * t.first_frame;
    const bool on_thing = x > 118 && x < 182 && y > -2 && y < 62;
    moving += t.moving ? 1 : 0;
    moving_on_thing += t.moving && on_thing ? 1 : 0;
    still += t.moving ? 0 : 1;
  }
  EXPECT_GT(moving_on_thing, 15);
  EXPECT_GT(moving_on_thing, 0.8 * moving);
  EXPECT_GT(still, 60);
}

TEST(TrackSplit, OneJobPerCameraAndOnlyWhenMotionTellsTheClocks) {
  Shot shot;
  shot.cameras.resize(2);
  shot.cameras[0].name = "left";
  shot.cameras[1].name = "right";
  const ShotState state(shot, [](const std::string&) { return std::nullopt; });
  const auto units = TrackJob::split(state, {});
  ASSERT_EQ(units.size(), 2U);
  EXPECT_EQ(units[1].name, "track/right");
  EXPECT_EQ(units[1].needs, (std::vector<std::string>{"ingest/right", "calibrate"}));
  shot.sections["sync"] = {"shot.toml", "sync", 1, {{"method", {"known", 2}}}};
  EXPECT_TRUE(TrackJob::split(state, {}).empty());
}

TEST_F(FollowedScene, NothingIsFollowedWhereAMaskSaysSo) {
  const auto counts = [](int) {
    cv::Mat1b mask(180, 320, uchar{255});
    mask.colRange(0, 200).setTo(0);
    return mask;
  };
  const auto masked = follow_features(camera_->num_frames, grey, {}, {}, counts);
  EXPECT_GT(masked.size(), 20U);
  for (const Track& track : masked)
    for (const auto& px : track.px) EXPECT_GT(px.x(), 200 - 3);
}

}  // namespace
}  // namespace vantage::track
