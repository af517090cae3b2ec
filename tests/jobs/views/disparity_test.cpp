#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "jobs/views/disparity_curve.h"
#include "jobs/views/disparity_knots.h"
#include "jobs/views/monotone_cubic.h"

namespace vantage {
namespace {

constexpr double kWidth_px = 1920;

double percent(double px) { return 100 * px / kWidth_px; }

DisparityMapping mapping(const std::string& kind) {
  DisparityMapping m;
  m.kind = kind;
  m.width_px = kWidth_px;
  m.points_percent = {{-6, -2}, {-1, -0.8}, {0, 0}, {4, 1}};
  return m;
}

/// A wall far behind, a floor, and an actor near, with a few wild depths: disparities in px.
std::vector<double> scene_disparities_px(unsigned seed = 1) {
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  std::vector<double> d;
  for (int k = 0; k < 50000; ++k) d.push_back(uniform(-104, -98));
  for (int k = 0; k < 30000; ++k) d.push_back(uniform(-98, 60));
  for (int k = 0; k < 20000; ++k) d.push_back(uniform(40, 60));
  for (int k = 0; k < 20; ++k) d.push_back(uniform(-900, 900));
  return d;
}

DisparityHistogram histogram_of(const std::vector<double>& disparities_px) {
  DisparityHistogram h(kWidth_px);
  for (const double d : disparities_px) h.add(d, 1);
  return h;
}

class EveryMap : public testing::TestWithParam<const char*> {};

TEST_P(EveryMap, KeepsTheOrderOfThings) {
  const DisparityCurve curve = disparity_curve(mapping(GetParam()), histogram_of(scene_disparities_px()));
  double last = curve(-3000);
  for (double d = -3000; d <= 3000; d += 0.37) {
    EXPECT_GE(curve(d), last) << d;
    last = curve(d);
  }
  EXPECT_GT(curve(50), curve(-90) + 10);
}

TEST_P(EveryMap, HasNoSteps) {
  const DisparityCurve curve = disparity_curve(mapping(GetParam()), histogram_of(scene_disparities_px()));
  for (double d = -1000; d <= 1000; d += 0.1) EXPECT_LE(curve(d + 0.1) - curve(d), 0.1 * 4 * 4 + 1e-9) << d;
}

TEST_P(EveryMap, StaysInTheBudget) {
  if (GetParam() == std::string("linear")) return;  // does as it is told
  const std::vector<double> scene = scene_disparities_px();
  const DisparityMapping m = mapping(GetParam());
  const DisparityCurve curve = disparity_curve(m, histogram_of(scene));
  int outside = 0;
  for (const double d : scene)
    outside +=
        percent(curve(d)) > m.budget.crossed_percent + 1e-6 || percent(curve(d)) < -m.budget.uncrossed_percent - 1e-6;
  EXPECT_EQ(outside, 0);
}

INSTANTIATE_TEST_SUITE_P(DisparityMap, EveryMap, testing::Values("linear", "fit", "log", "piecewise", "histogram"));

TEST(DisparityMap, LineIsGainAndOffset) {
  DisparityMapping m = mapping("linear");
  m.gain = 0.5;
  m.offset_px = 3;
  for (const double d : {-500.0, -0.25, 0.0, 7.5, 4000.0}) EXPECT_NEAR(disparity_curve(m, {})(d), 0.5 * d + 3, 1e-9);
}

TEST(DisparityMap, FitBringsTheScenesRangeOntoTheBudget) {
  const DisparityCurve curve = disparity_curve(mapping("fit"), histogram_of(scene_disparities_px()));
  EXPECT_NEAR(percent(curve(-104)), -2, 0.02);
  EXPECT_NEAR(percent(curve(60)), 1, 0.02);
  EXPECT_NEAR(percent(curve(-22)), -0.5, 0.02);  // straight
}

TEST(DisparityMap, LogIsNaturalAtTheScreenAndReachesTheBudgetAtTheScenesEnds) {
  const DisparityCurve curve = disparity_curve(mapping("log"), histogram_of(scene_disparities_px()));
  EXPECT_NEAR(curve(0), 0, 1e-9);
  EXPECT_NEAR(curve(1) - curve(-1), 2, 0.15);
  EXPECT_NEAR(percent(curve(-104)), -2, 0.02);
  EXPECT_NEAR(percent(curve(60)), 1, 0.02);
  EXPECT_LT(curve(60) - curve(50), curve(10) - curve(0));
}

TEST(DisparityMap, LogLeavesASceneInTheBudgetAsItIs) {
  const DisparityCurve curve = disparity_curve(mapping("log"), histogram_of({-20, -10, 0, 5, 10}));
  for (const double d : {-20.0, -3.0, 0.0, 9.0}) EXPECT_NEAR(curve(d), d, 1e-6);
}

TEST(DisparityMap, PiecewiseMeetsItsPoints) {
  const DisparityMapping m = mapping("piecewise");
  const DisparityCurve curve = disparity_curve(m, {});
  for (const auto& [from, to] : m.points_percent) EXPECT_NEAR(percent(curve(from / 100 * kWidth_px)), to, 0.01);
}

TEST(DisparityMap, HistogramGivesMoreRoomToWhatFillsThePicture) {
  const DisparityHistogram scene = histogram_of(scene_disparities_px());
  const DisparityCurve fit = disparity_curve(mapping("fit"), scene),
                       curve = disparity_curve(mapping("histogram"), scene);
  EXPECT_GT(curve(60) - curve(40), 1.3 * (fit(60) - fit(40)));    // the actor
  EXPECT_LT(curve(20) - curve(-60), 0.8 * (fit(20) - fit(-60)));  // hardly anything is there
  DisparityMapping even = mapping("histogram");
  even.strength = 0;
  for (double d = -100; d < 60; d += 10) EXPECT_NEAR(disparity_curve(even, scene)(d), fit(d), 0.5);
}

TEST(DisparityMap, AFlatSceneIsNotBlownUp) {
  const DisparityHistogram scene = histogram_of({4, 4.1, 4.2, 4.3, 5});
  for (const char* kind : {"fit", "histogram"}) {
    const DisparityCurve curve = disparity_curve(mapping(kind), scene);
    EXPECT_LE(curve(100) - curve(-100), 4 * 2 + 1) << kind;  // the scene is 1 px deep, within 2 cells
  }
}

TEST(DisparityMap, MeanOfTwoCurvesIsTheirMeanEverywhere) {
  const DisparityCurve a = disparity_curve(mapping("fit"), histogram_of(scene_disparities_px())),
                       b = disparity_curve(mapping("fit"), histogram_of({-40, 0, 10})),
                       c = DisparityCurve::mean(a, b, 0.25);
  for (double d = -1200; d < 1200; d += 31) EXPECT_NEAR(c(d), 0.75 * a(d) + 0.25 * b(d), 1e-9);
}

TEST(DisparityMap, SurvivesJson) {
  const DisparityMapping m = mapping("piecewise");
  EXPECT_EQ(to_json(disparity_mapping_from(Json::parse(to_json(m).dump()))), to_json(m));
}

TEST(DisparityHistogram, QuantilesAndSharesAreInverse) {
  const DisparityHistogram h = histogram_of(scene_disparities_px());
  for (const double share : {0.01, 0.3, 0.5, 0.9}) EXPECT_NEAR(h.share_below(h.quantile(share)), share, 1e-9);
}

/// Weights of a film's knots by knot frame, per frame.
TEST(DisparityKnots, WeightsSumToOneAndChangeSmoothly) {
  for (const int num_frames : {1, 2, 7, 30, 31, 47, 100, 301}) {
    const auto weights = knot_weights(num_frames, 30);
    ASSERT_EQ(weights.size(), static_cast<std::size_t>(num_frames));
    std::vector<double> last;
    for (const auto& frame : weights) {
      std::vector<double> now(static_cast<std::size_t>(num_frames), 0.0);
      double sum = 0;
      for (const KnotWeight& w : frame) {
        now.at(static_cast<std::size_t>(w.frame)) += w.weight;
        sum += w.weight;
      }
      EXPECT_NEAR(sum, 1, 1e-12);
      for (std::size_t k = 0; !last.empty() && num_frames > 20 && k < now.size(); ++k)
        EXPECT_LE(std::abs(now[k] - last[k]), 1.5 / 20);
      last = now;
    }
  }
}

TEST(MonotoneCubic, MeetsItsPointsAndNeverOvershoots) {
  const MonotoneCubic curve({0, 1, 1.5, 4, 5}, {0, 0, 3, 3.1, 9});
  EXPECT_EQ(curve(0.5), 0);
  EXPECT_NEAR(curve(1.5), 3, 1e-12);
  double last = -1;
  for (double x = -1; x < 6; x += 0.01) {
    EXPECT_GE(curve(x), last - 1e-12);
    last = curve(x);
  }
  EXPECT_EQ(last, 9);
}

}  // namespace
}  // namespace vantage
