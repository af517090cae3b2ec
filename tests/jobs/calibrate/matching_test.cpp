#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>
#include <random>

#include "jobs/calibrate/features.h"
#include "jobs/calibrate/moments.h"
#include "jobs/calibrate/picture_pair.h"
#include "jobs/calibrate/plate.h"

namespace vantage {
namespace {

/// A soft bright spot; centre in px, pixel centres at +0.5.
cv::Mat spot(cv::Size size, Eigen::Vector2d centre, double sigma_px = 3) {
  cv::Mat out(size, CV_8UC3, cv::Scalar::all(40));
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const double r2 = (Eigen::Vector2d(x + 0.5, y + 0.5) - centre).squaredNorm();
      out.at<cv::Vec3b>(y, x) += cv::Vec3b::all(static_cast<uchar>(180 * std::exp(-r2 / (2 * sigma_px * sigma_px))));
    }
  return out;
}

cv::Mat texture(cv::Size size, int seed) {
  cv::Mat out(size, CV_8UC3);
  cv::RNG(static_cast<std::uint64_t>(seed)).fill(out, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(out, out, {}, 2);
  cv::normalize(out, out, 0, 255, cv::NORM_MINMAX);
  return out;
}

double nearest_px(const Features& features, const Eigen::Vector2d& to) {
  double least = 1e9;
  for (const auto& px : features.px) least = std::min(least, (px - to).norm());
  return least;
}

/// Each of `num` things has its own descriptor; things are shuffled by `seed`.
Features things(const std::vector<Eigen::Vector2d>& px, unsigned first_thing, double noise, unsigned noise_seed) {
  Features out;
  out.px = px;
  out.rgb.assign(px.size(), Eigen::Vector3i::Zero());
  out.descriptors.resize(static_cast<Eigen::Index>(px.size()), 128);
  std::mt19937 noise_random(noise_seed);
  std::normal_distribution<float> normal(0, 1);
  for (std::size_t i = 0; i < px.size(); ++i) {
    std::mt19937 random(first_thing + static_cast<unsigned>(i));
    for (int k = 0; k < 128; ++k)
      out.descriptors(static_cast<Eigen::Index>(i), k) =
          std::abs(normal(random)) + static_cast<float>(noise) * normal(noise_random);
    out.descriptors.row(static_cast<Eigen::Index>(i)).normalize();
  }
  return out;
}

TEST(Features, LieWhereTheThingIs) {
  for (const cv::Size size : {cv::Size(160, 120), cv::Size(640, 480)})
    for (const Eigen::Vector2d& centre : {Eigen::Vector2d(61.3, 58.9), Eigen::Vector2d(80, 60.5)})
      EXPECT_LT(nearest_px(find_features(spot(size, centre), {}, {.max_side_px = 320}), centre), 0.12) << size;
}

TEST(Features, AreNotSoughtWhereTheMaskSaysNo) {
  const cv::Mat picture = texture({200, 160}, 3);
  cv::Mat1b left(160, 200, uchar{0});
  left(cv::Rect(0, 0, 100, 160)).setTo(255);
  const Features features = find_features(picture, left, {});
  EXPECT_GT(features.size(), 30U);
  for (const auto& px : features.px) EXPECT_LT(px.x(), 101);
}

TEST(FeatureMatching, PairsWhatIsMutualAndDistinct) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> at(0, 600);
  std::vector<Eigen::Vector2d> px(700);
  for (auto& p : px) p = {at(random), at(random)};
  const Features a = things(px, 100, 0.1, 1), b = things(px, 100, 0.1, 2);
  const auto matches = match_features(a, b, 0.8);
  ASSERT_EQ(matches.size(), px.size());
  for (const auto& m : matches) EXPECT_EQ(m.a, m.b);
  const Features other = things(px, 5000, 0.1, 2);
  EXPECT_LT(match_features(a, other, 0.8).size(), 8U);
}

TEST(FeatureMatching, AmongTwinsTheBandDecides) {
  const Eigen::Matrix3d same_row = (Eigen::Matrix3d() << 0, 0, 0, 0, 0, -1, 0, 1, 0).finished();  // y_b = y_a
  const Features a = things({{50, 30}}, 9, 0, 1);
  Features b = things({{70, 90}, {40, 31}}, 9, 0, 1);
  b.descriptors.row(1) = b.descriptors.row(0);
  EXPECT_TRUE(match_features(a, b, 0.8).empty());
  EXPECT_EQ(match_features(a, b, 0.8, EpipolarBand{.F = same_row, .max_px = 3}),
            (std::vector<FeatureMatch>{{.a = 0, .b = 1}}));
}

/// Random points seen by two cameras 30 degrees apart, as glimpses of the given moments.
Survey two_views(const std::vector<int>& moments_a, const std::vector<int>& moments_b) {
  Survey survey;
  for (const bool second : {false, true}) {
    Survey::Picture picture{.image = {second ? "b" : "a", 0}, .width = 640, .height = 360, .glimpses = {}};
    const Eigen::Matrix3d R = Eigen::AngleAxisd(second ? 0.5 : 0.0, Eigen::Vector3d::UnitY()).toRotationMatrix();
    for (const int moment : second ? moments_b : moments_a) {
      std::mt19937 random(static_cast<unsigned>(moment + 10));
      std::uniform_real_distribution<double> in_box(-1, 1);
      std::vector<Eigen::Vector2d> px;
      for (int i = 0; i < 12; ++i) {
        const Eigen::Vector3d p(in_box(random), in_box(random), in_box(random));
        px.push_back(500 * (R * p + Eigen::Vector3d(0, 0, 5)).hnormalized() + Eigen::Vector2d(320, 180));
      }
      picture.glimpses.push_back({.moment = moment,
                                  .frame = moment,
                                  .features = things(px, static_cast<unsigned>(1000 * (moment + 2)), 0.05, second),
                                  .carried_px = {}});
    }
    survey.pictures.push_back(std::move(picture));
  }
  return survey;
}

TEST(PicturePair, WhatMovesIsMatchedAtEqualMomentsAndAllOfThemTellOneGeometry) {
  const PicturePair pair = match_pictures(two_views({0, 1, 2, 3, 4}, {1, 2, 3, 4, 7}), 0, 1, {});
  ASSERT_GT(pair.matches.size(), 40U);
  for (const auto& m : pair.matches) EXPECT_EQ(m.a - 12, m.b);  // moment 1 is a's second glimpse, b's first
}

TEST(PicturePair, NothingAtEqualMomentsIsNothingInCommon) {
  EXPECT_TRUE(match_pictures(two_views({0, 1, 2, 3}, {5, 6, 7, 8}), 0, 1, {}).matches.empty());
}

TEST(PicturePair, UnrelatedPlacesOfEqualThingsAreChance) {
  Survey survey = two_views({0, 1, 2, 3, 4, 5, 6, 7}, {0, 1, 2, 3, 4, 5, 6, 7});
  std::mt19937 random(1);
  for (auto& glimpse : survey.pictures[1].glimpses)
    std::shuffle(glimpse.features.px.begin(), glimpse.features.px.end(), random);
  EXPECT_TRUE(match_pictures(survey, 0, 1, {}).matches.empty());
}

FilmedCamera filmed(const std::string& name, double start_s, int num_frames) {
  FilmedCamera out{.table = {.camera = name, .width = 320, .height = 200, .fps = 10, .pts_s = {}}, .start_s = start_s};
  for (int k = 0; k < num_frames; ++k) out.table.pts_s.push_back(0.1 * k);
  return out;
}

TEST(Moments, AreThoseThatTwoCamerasFilm) {
  const std::vector<FilmedCamera> cameras{filmed("a", 0, 10), filmed("b", 0.5, 10)};
  const auto moments = choose_moments(cameras, 24);
  ASSERT_EQ(moments.size(), 5U);
  EXPECT_NEAR(moments.front(), 0.5, 1e-9);
  EXPECT_EQ(frame_near(cameras[1], 0.5), 0);
  EXPECT_EQ(frame_near(cameras[0], 0.56), 6);
  EXPECT_FALSE(frame_near(cameras[0], 1.2));
  FilmedCamera unknown = cameras[1];
  unknown.start_s.reset();
  EXPECT_TRUE(choose_moments({cameras[0], unknown}, 24).empty());
}

TEST(Moments, FeaturesAreCarriedToTheMoment) {
  const cv::Mat ground = texture({320, 200}, 1), thing = texture({60, 60}, 2);
  const auto frame = [&](int k) {  // 4 px a frame
    cv::Mat out = ground.clone();
    thing.copyTo(out(cv::Rect(40 + 4 * k, 70, 60, 60)));
    return out;
  };
  const Footage footage{.frame = [&](const ImageId& image) { return frame(image.frame); },
                        .counts = [](const std::string&, const std::vector<int>&) { return cv::Mat(); }};
  std::vector<cv::Mat> pictures;
  for (const int k : {0, 16, 17, 32, 33, 48, 49}) pictures.push_back(frame(k));
  const Plate plate = make_plate(pictures);
  const FilmedCamera camera = filmed("a", 2, 50);
  const auto at = glimpse_of_motion(camera, plate, 0, 2.5, footage, {});
  const auto between = glimpse_of_motion(camera, plate, 0, 2.53, footage, {});
  ASSERT_TRUE(at && between);
  EXPECT_EQ(between->frame, 5);
  ASSERT_GT(between->features.size(), 20U);
  int num_carried = 0;
  for (std::size_t i = 0; i < between->features.size(); ++i) {
    const Eigen::Vector2d& px = between->features.px[i];
    if (px.x() < 70 || px.x() > 110 || px.y() < 80 || px.y() > 120) continue;  // the thing, less its rim
    ++num_carried;
    EXPECT_LT((between->carried_px[i] - Eigen::Vector2d(1.2, 0)).norm(), 0.15);
    EXPECT_LT(nearest_px(at->features, px - between->carried_px[i]), 1e-6);
  }
  EXPECT_GT(num_carried, 10);
}

TEST(Plate, IsSteadyWhereNothingCameForLong) {
  std::vector<cv::Mat> pictures;
  for (int k = 0; k < 20; ++k) {
    cv::Mat picture(40, 60, CV_8UC3, cv::Scalar(10, 20, 30));
    if (k < 8) picture(cv::Rect(10, 10, 12, 12)).setTo(cv::Scalar(200, 200, 200));  // 40 % of the time
    if (k == 3) picture(cv::Rect(40, 10, 12, 12)).setTo(cv::Scalar(200, 200, 200));
    pictures.push_back(picture);
  }
  const Plate plate = make_plate(pictures);
  EXPECT_EQ(plate.steady.at<uchar>(16, 16), 0);
  EXPECT_EQ(plate.steady.at<uchar>(16, 46), 255);
  const cv::Mat moves = what_moves(pictures[3], plate);
  EXPECT_EQ(moves.at<uchar>(16, 46), 255);
  EXPECT_EQ(moves.at<uchar>(34, 30), 0);
}

}  // namespace
}  // namespace vantage
