#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <random>

#include "jobs/calibrate/colour_samples.h"
#include "jobs/calibrate/colour_solve.h"
#include "tests/support/synthetic_scene.h"

namespace vantage {
namespace {

/// What a camera makes of linear light: gain · 0.18 · (L / 0.18)^gamma. Geometric means over the four are 1, so the
/// shared look is the scene's own.
struct Filmed {
  std::array<double, 3> gain;  // red, green, blue
  double gamma;
};
const std::vector<Filmed> kFilmed{
    {{0.8, 0.9, 1.0}, 1.0}, {{1.25, 1.1, 0.8}, 1.08}, {{1.0, 1.0 / 0.99, 1.25}, 0.92}, {{1.0, 1.0, 1.0}, 1.0}};

cv::Mat3b film(const cv::Mat3b& bgr, const Filmed& as, double noise, int seed) {
  cv::Mat3b out(bgr.size());
  std::mt19937 random(static_cast<unsigned>(seed));
  std::normal_distribution<double> normal(0, noise);
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x)
      for (int c = 0; c < 3; ++c) {
        const double linear = linear_of_level(bgr(y, x)[c]);
        const double seen = as.gain[static_cast<std::size_t>(2 - c)] * kMidGrey * std::pow(linear / kMidGrey, as.gamma);
        out(y, x)[c] = cv::saturate_cast<uchar>(level_of_linear(seen) + normal(random));
      }
  return out;
}

class ColourOfScene : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_pictures_ = new std::vector<PosedColourPicture>;
    const synthetic::Scene scene({.moving = false});
    for (const auto& camera : synthetic::arc_cameras(4, 1, 480, 270))
      scene_pictures_->push_back({.camera = static_cast<int>(scene_pictures_->size()),
                                  .bgr = scene.render(camera.pinhole, camera.cam_from_world, 0).bgr,
                                  .counts = {},
                                  .pinhole = camera.pinhole,
                                  .cam_from_world = camera.cam_from_world});
  }
  static void TearDownTestSuite() { delete scene_pictures_; }
  static std::vector<PosedColourPicture> filmed(const std::vector<Filmed>& as, double noise) {
    auto pictures = *scene_pictures_;
    for (std::size_t c = 0; c < pictures.size(); ++c)
      pictures[c].bgr = film(pictures[c].bgr, as[c], noise, static_cast<int>(c));
    return pictures;
  }
  static std::vector<PosedColourPicture>* scene_pictures_;
};
std::vector<PosedColourPicture>* ColourOfScene::scene_pictures_ = nullptr;

TEST_F(ColourOfScene, GainsAndGammasAreFoundFromWhatCamerasSeeInCommon) {
  const auto solution = solve_colours(colour_samples(filmed(kFilmed, 1.5)), 4);
  EXPECT_TRUE(solution.is_significant());
  for (std::size_t c = 0; c < 4; ++c) {
    EXPECT_GT(solution.num_samples[c], 100);
    EXPECT_NEAR(solution.colours[c].gamma * kFilmed[c].gamma, 1, 0.02) << c;
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(solution.colours[c].gain[k] * std::pow(kFilmed[c].gain[k], solution.colours[c].gamma), 1, 0.02)
          << c << ' ' << k;
  }
}

TEST_F(ColourOfScene, PicturesOfTheSharedLookAgree) {
  const auto pictures = filmed(kFilmed, 0);
  const auto solution = solve_colours(colour_samples(pictures), 4);
  for (std::size_t c = 0; c < 4; ++c) {
    cv::Mat3b matched = pictures[c].bgr.clone();
    for (int k = 0; k < 3; ++k) {
      const auto table = level_table(solution.colours[c], 2 - k);
      for (auto& pixel : matched) pixel[k] = table[pixel[k]];
    }
    // Against the scene's own colours, brightest fifth left out: what a camera clipped is gone.
    const cv::Mat clipped = pictures[c].bgr > cv::Scalar::all(254);
    cv::Mat3b truth = (*scene_pictures_)[c].bgr.clone();
    truth.setTo(0, clipped), matched.setTo(0, clipped);
    EXPECT_GT(cv::PSNR(matched, truth), 38) << c;
  }
}

TEST_F(ColourOfScene, CamerasThatAgreeStayAsTheyAre) {
  const std::vector<Filmed> same(4, {{1, 1, 1}, 1});
  EXPECT_FALSE(solve_colours(colour_samples(filmed(same, 3)), 4).is_significant());
}

/// Samples of two cameras as the model says, with noise of the logarithm.
std::vector<ColourSample> samples_of(double gain, double gamma, double noise, int num, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, noise);
  std::uniform_real_distribution<double> light(0.05, 0.6);
  std::vector<ColourSample> samples;
  for (int i = 0; i < num; ++i) {
    ColourSample s{.camera_a = 0, .camera_b = 1, .linear_a = {}, .linear_b = {}};
    for (int k = 0; k < 3; ++k) {
      const double linear = light(random);
      s.linear_a[k] = linear * std::exp(normal(random));
      s.linear_b[k] = gain * kMidGrey * std::pow(linear / kMidGrey, gamma) * std::exp(normal(random));
    }
    samples.push_back(s);
  }
  return samples;
}

TEST(SolveColours, WrongMatchesDoNotSpoilTheSolution) {
  auto samples = samples_of(1.2, 1.1, 0.02, 300, 1);
  const auto wrong = samples_of(5, 0.3, 0.5, 60, 2);
  samples.insert(samples.end(), wrong.begin(), wrong.end());
  const auto colours = solve_colours(samples, 3).colours;
  EXPECT_NEAR(colours[0].gamma / colours[1].gamma, 1.1, 0.03);
  EXPECT_NEAR(colours[0].gain[1], std::sqrt(1.2), 0.03);
  EXPECT_NEAR(colours[2].gain[1], 1, 1e-6) << "a camera without samples stays as it is";
  EXPECT_NEAR(colours[2].gamma, 1, 1e-6);
}

TEST(SolveColours, StandardDeviationsAreTrue) {
  double sum = 0;
  constexpr int kSeeds = 60;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    const auto solution = solve_colours(samples_of(1, 1, 0.05, 200, seed), 2);
    sum += std::pow(std::log(solution.colours[0].gain[1]) / solution.gain_std[0], 2);
  }
  EXPECT_NEAR(std::sqrt(sum / kSeeds), 1, 0.3);
}

}  // namespace
}  // namespace vantage
