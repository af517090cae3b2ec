#include "jobs/correspond/semi_global.h"

#include <gtest/gtest.h>

#include "jobs/correspond/plane_sweep.h"

namespace vantage {
namespace {

void set_costs(CostVolume& volume, int x, int y, int best, std::uint8_t cost_at_best) {
  for (int d = 0; d < volume.num_labels; ++d) volume.at(x, y)[d] = d == best ? cost_at_best : 30;
}

TEST(SemiGlobal, NeighboursOutvoteAPixelThatIsWrong) {
  CostVolume volume({9, 9}, 20);
  for (int y = 0; y < 9; ++y)
    for (int x = 0; x < 9; ++x) set_costs(volume, x, y, 7, 5);
  set_costs(volume, 4, 4, 15, 4);
  const cv::Mat1f labels = semi_global_labels(volume, cv::Mat1b(9, 9, uchar{100}));
  EXPECT_NEAR(labels(4, 4), 7, 0.5);
  EXPECT_NEAR(labels(0, 8), 7, 0.5);
}

TEST(SemiGlobal, AJumpThatThePictureShowsStaysSharp) {
  CostVolume volume({12, 8}, 20);
  cv::Mat1b guide(8, 12);
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 12; ++x) {
      set_costs(volume, x, y, x < 6 ? 3 : 16, 5);
      guide(y, x) = x < 6 ? 20 : 200;
    }
  const cv::Mat1f labels = semi_global_labels(volume, guide);
  for (int y = 0; y < 8; ++y) {
    EXPECT_NEAR(labels(y, 5), 3, 0.5);
    EXPECT_NEAR(labels(y, 6), 16, 0.5);
  }
}

TEST(SweepBetween, NoStepIsLongerThanAPixel) {
  const Pinhole pinhole{320, 180, 300, 300, 160, 90};
  RigidTransform b;
  b.t = {-0.5, 0.05, 0.1};
  const TwoView views(pinhole, {}, pinhole, b);
  const Sweep sweep = sweep_between(views, {320, 180}, 0.1, 0.8, 1000);
  ASSERT_GT(sweep.count, 10);
  EXPECT_NEAR(sweep.last(), 0.8, 1e-9);
  for (const double w : {0.1, 0.45, 0.8 - sweep.step})
    for (const Eigen::Vector2d& px : {Eigen::Vector2d(0, 0), Eigen::Vector2d(319, 90), Eigen::Vector2d(160, 179)})
      EXPECT_LE((*views.project(px, w + sweep.step) - *views.project(px, w)).norm(), 1.001);
}

TEST(SweepBetween, NoneWithoutParallax) {
  const Pinhole pinhole{320, 180, 300, 300, 160, 90};
  EXPECT_EQ(widest_sweep({pinhole, {}, pinhole, {}}, {320, 180}, 384).count, 0);
}

}  // namespace
}  // namespace vantage
