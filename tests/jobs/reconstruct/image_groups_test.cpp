#include "jobs/groups/image_groups.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

namespace vantage {
namespace {

GroupCamera camera_at(int number, double azimuth_deg, int num_frames, double offset_s) {
  const double a = azimuth_deg * std::numbers::pi / 180;
  GroupCamera c;
  c.name = "cam" + std::to_string(number);
  c.centre = {4 * std::sin(a), -1, -4 * std::cos(a)};
  c.forward = -Eigen::Vector3d(std::sin(a), 0, -std::cos(a));
  c.up = -Eigen::Vector3d::UnitY();
  for (int f = 0; f < num_frames; ++f) c.images.push_back({f, offset_s + f / 30.0});
  return c;
}

std::vector<GroupCamera> arc(int count, double step_deg, int num_frames) {
  std::vector<GroupCamera> out;
  for (int k = 0; k < count; ++k) out.push_back(camera_at(k, step_deg * ((5 * k) % count), num_frames, 0.007 * k));
  return out;
}

TEST(ImageGroups, WindowsHoldConsecutiveFramesOfEveryCameraAndOverlapByHalf) {
  const auto groups = image_groups(arc(5, 8, 12), 4);
  ASSERT_GE(groups.size(), 5U);
  EXPECT_EQ(groups[1].size(), 20U);
  EXPECT_EQ(groups[0].front().frame, 0);
  EXPECT_EQ(groups[1].front().frame, 2);
  std::set<ImageId> all;
  for (const auto& group : groups) all.insert(group.begin(), group.end());
  EXPECT_EQ(all.size(), 60U);
}

TEST(ImageGroups, StillsOfOneMomentMakeOneGroup) {
  const auto groups = image_groups(arc(6, 8, 1), 4);
  ASSERT_EQ(groups.size(), 1U);
  EXPECT_EQ(groups[0].size(), 6U);
}

TEST(ImageGroups, ManyCamerasSplitIntoOverlappingNeighbourhoodsOfEight) {
  const auto cameras = arc(11, 8, 1);
  const auto neighbourhoods = camera_neighbourhoods(cameras);
  ASSERT_EQ(neighbourhoods.size(), 2U);
  std::set<int> all;
  for (const auto& members : neighbourhoods) {
    EXPECT_EQ(members.size(), 8U);
    all.insert(members.begin(), members.end());
    for (std::size_t k = 1; k < members.size(); ++k) {  // neighbours on the arc are neighbours in the list
      const auto at = [&](std::size_t i) { return cameras[static_cast<std::size_t>(members[i])].centre; };
      EXPECT_NEAR((at(k) - at(k - 1)).norm(), 8 * std::sin(4 * std::numbers::pi / 180), 1e-6);
    }
  }
  EXPECT_EQ(all.size(), 11U);
}

TEST(ImageGroups, ARingOfCamerasHasNoEnd) {
  const auto neighbourhoods = camera_neighbourhoods(arc(12, 30, 1));
  EXPECT_EQ(neighbourhoods.size(), 3U);
}

TEST(ImageGroups, NeverExceedSixtyFourImages) {
  for (const auto& group : image_groups(arc(8, 5, 40), 8)) EXPECT_LE(group.size(), 64U);
  std::vector<GroupCamera> mixed = arc(8, 5, 10);
  mixed[3].images.clear();
  for (int f = 0; f < 200; ++f) mixed[3].images.push_back({f, f / 600.0});
  for (const auto& group : image_groups(mixed, 8)) EXPECT_LE(group.size(), 64U);
}

TEST(ImageGroups, OneCameraIsNoGroup) { EXPECT_TRUE(image_groups(arc(1, 8, 10), 4).empty()); }

TEST(ImageGroups, CamerasThatFilmedAtDifferentTimesShareNoGroup) {
  std::vector<GroupCamera> cameras{camera_at(0, 0, 10, 0), camera_at(1, 10, 10, 5)};
  EXPECT_TRUE(image_groups(cameras, 4).empty());
}

}  // namespace
}  // namespace vantage
