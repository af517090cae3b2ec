#include "jobs/fuse/fuse_patches.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace vantage {
namespace {

const PatchSpacing kSpacing = [](const Patch&) { return 0.02; };

Patch patch_at(float x, float y, float z, float t0, float t1, const Eigen::Vector3f& v = Eigen::Vector3f::Zero()) {
  Patch p;
  p.position = {x, y, z};
  p.normal = {0, 0, -1};
  p.velocity = v;
  p.t0_s = t0;
  p.t1_s = t1;
  p.score = 0.9F;
  p.num_views = 5;
  return p;
}

/// A wall of 10 x 10 patches of one group.
std::vector<Patch> wall(float z, float t0, float t1, const Eigen::Vector3f& v = Eigen::Vector3f::Zero()) {
  std::vector<Patch> out;
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 10; ++x)
      out.push_back(patch_at(0.02F * static_cast<float>(x), 0.02F * static_cast<float>(y), z, t0, t1, v));
  return out;
}

TEST(FusePatches, StaticPatchesOfAllGroupsBecomeOneValidOverAllTheirTimes) {
  FuseReport report;
  const auto model =
      fuse_patches({wall(3, 0, 0.1F), wall(3.002F, 0.1F, 0.2F), wall(2.998F, 0.2F, 0.3F)}, kSpacing, {}, report);
  ASSERT_EQ(model.size(), 100U);
  EXPECT_EQ(report.num_merged, 200);
  for (const Patch& p : model) {
    EXPECT_FLOAT_EQ(p.t0_s, 0);
    EXPECT_FLOAT_EQ(p.t1_s, 0.3F);
    EXPECT_NEAR(p.position.z(), 3, 1e-5);  // the mean of the groups
  }
}

TEST(FusePatches, PatchesOfOneGroupAreNeverMerged) {
  FuseReport report;
  EXPECT_EQ(fuse_patches(
                {wall(3, 0, 0.1F)}, [](const Patch&) { return 0.2; }, {}, report)
                .size(),
            100U);
}

TEST(FusePatches, DifferentSurfacesStayApart) {
  FuseReport report;
  EXPECT_EQ(fuse_patches({wall(3, 0, 0.1F), wall(3.05F, 0.1F, 0.2F)}, kSpacing, {}, report).size(), 200U);
  auto back = wall(3, 0.1F, 0.2F);  // the other side of a thin wall
  for (Patch& p : back) p.normal = {0, 0, 1};
  EXPECT_EQ(fuse_patches({wall(3, 0, 0.1F), back}, kSpacing, {}, report).size(), 200U);
}

TEST(FusePatches, MovingPatchesMergeWhereTheyAreAtTheSameTime) {
  const Eigen::Vector3f v(1, 0, 0);
  auto later = wall(3, 0.05F, 0.15F, v);
  for (Patch& p : later) p.position += 0.05F * v;  // where the first group's patches are by then
  FuseReport report;
  const auto model = fuse_patches({wall(3, 0, 0.1F, v), later}, kSpacing, {}, report);
  ASSERT_EQ(model.size(), 100U);
  EXPECT_EQ(report.num_moving, 100);
  for (const Patch& p : model) {
    EXPECT_FLOAT_EQ(p.t0_s, 0);
    EXPECT_FLOAT_EQ(p.t1_s, 0.15F);
  }
}

TEST(FusePatches, OppositeMotionsStayApart) {
  FuseReport report;
  const auto model = fuse_patches({wall(3, 0, 0.1F, {1, 0, 0}), wall(3, 0, 0.1F, {-1, 0, 0})}, kSpacing, {}, report);
  EXPECT_EQ(model.size(), 200U);
}

TEST(FusePatches, MotionIsNotStretchedBeyondOneAndAHalfGroups) {
  const Eigen::Vector3f v(0.1F, 0, 0);
  std::vector<std::vector<Patch>> groups;
  for (int g = 0; g < 4; ++g) {
    const float t0 = 0.05F * static_cast<float>(g);
    groups.push_back(wall(3, t0, t0 + 0.1F, v));
    for (Patch& p : groups.back()) p.position += t0 * v;
  }
  FuseReport report;
  for (const Patch& p : fuse_patches(groups, kSpacing, {}, report)) EXPECT_LE(p.t1_s - p.t0_s, 0.1501F);
}

TEST(FusePatches, StaticPatchesThatNoOtherGroupHasSeenAreDroppedWhereThereAreManyGroups) {
  std::vector<std::vector<Patch>> groups;
  for (int g = 0; g < 6; ++g) groups.push_back(wall(3, 0.1F * static_cast<float>(g), 0.1F * static_cast<float>(g + 1)));
  groups[2].push_back(patch_at(0.1F, 0.1F, 2, 0.2F, 0.3F));
  FuseReport report;
  EXPECT_EQ(fuse_patches(groups, kSpacing, {}, report).size(), 100U);
  EXPECT_EQ(report.num_unsupported, 1);
  groups.resize(3);  // too few groups to tell
  EXPECT_EQ(fuse_patches(groups, kSpacing, {}, report).size(), 101U);
}

TEST(FusePatches, NothingInNothingOut) {
  FuseReport report;
  EXPECT_TRUE(fuse_patches({{}, {}}, kSpacing, {}, report).empty());
}

}  // namespace
}  // namespace vantage
