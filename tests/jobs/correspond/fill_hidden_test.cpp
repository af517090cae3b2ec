#include "jobs/correspond/fill_hidden.h"

#include <gtest/gtest.h>

namespace vantage {
namespace {

TEST(FillHidden, PixelsTakeTheMotionOfTheirSideOfAnEdge) {
  const cv::Vec2f moving(10, 0), still(0, 0);
  const cv::Rect left_of_a(0, 0, 60, 80), left_of_b(0, 0, 70, 80), hidden(60, 0, 10, 80);
  cv::Mat1f a(80, 120, 160.0F), b = a.clone();
  a(left_of_a).setTo(60);
  b(left_of_b).setTo(60);
  FlowPair flow{cv::Mat2f(a.size(), still), cv::Mat2f(b.size(), still)};
  flow.a_to_b(left_of_a).setTo(moving);
  flow.a_to_b(hidden).setTo(moving);  // what a smooth field says of pixels that b does not show
  flow.b_to_a(left_of_b).setTo(-moving);
  fill_hidden(a, b, flow);
  EXPECT_LT(cv::norm(flow.a_to_b(hidden), cv::NORM_INF), 0.1);
  EXPECT_EQ(cv::norm(flow.a_to_b(left_of_a), cv::Mat2f(left_of_a.size(), moving), cv::NORM_INF), 0);
}

TEST(FillHidden, WhereNothingComesBackMotionStays) {
  const cv::Mat1f grey(20, 30, 90.0F);
  FlowPair flow{cv::Mat2f(grey.size(), cv::Vec2f(5, 0)), cv::Mat2f(grey.size(), cv::Vec2f(5, 0))};
  fill_hidden(grey, grey, flow);
  EXPECT_EQ(flow.a_to_b(10, 10), cv::Vec2f(5, 0));
}

}  // namespace
}  // namespace vantage
