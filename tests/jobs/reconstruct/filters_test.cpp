#include "jobs/reconstruct/filters.h"

#include <gtest/gtest.h>

namespace vantage {
namespace {

/// Three cameras side by side that look along z; no pictures are needed to filter.
ViewGroup three_views() {
  ViewGroup group;
  group.num_cameras = 3;
  group.last_s = 0.2;
  for (int c = 0; c < 3; ++c) {
    View view;
    view.id = {"cam" + std::to_string(c), 0};
    view.camera = c;
    view.pinhole = {200, 150, 200, 200, 100, 75};
    view.centre = {0.4 * (c - 1), 0, 0};
    view.cam_from_world.t = -view.centre;
    view.main = true;
    group.views.push_back(view);
  }
  return group;
}

LivePatch patch_at(const PatchCloud& cloud, double x, double y, double z) {
  LivePatch p;
  p.reference = 1;
  p.position = {x, y, z};
  p.normal = {0, 0, -1};
  p.seen = 0b111;
  p.score = 0.9;
  p.radius = cloud.cell_width(1, z);
  return p;
}

/// A wall at z = 4 with a patch per cell of the middle view.
PatchCloud wall(const ViewGroup& group) {
  PatchCloud cloud(group, 4);
  for (int row = -8; row <= 8; ++row)
    for (int col = -8; col <= 8; ++col) cloud.add(patch_at(cloud, 0.08 * col + 0.04, 0.08 * row + 0.04, 4));
  return cloud;
}

TEST(Filters, AGoodWallStays) {
  const ViewGroup group = three_views();
  PatchCloud cloud = wall(group);
  EXPECT_EQ(filter(cloud, {}).total(), 0);
  EXPECT_EQ(cloud.patches().size(), 17U * 17U);
}

TEST(Filters, PatchesUnlikeTheirNeighboursAreDropped) {
  const ViewGroup group = three_views();
  PatchCloud cloud = wall(group);
  cloud.add(patch_at(cloud, 0.04, 0.04, 4.3));  // Eq. 9: far from the planes of all neighbours
  const FilterReport report = filter(cloud, {});
  EXPECT_EQ(report.irregular + report.behind, 1);
  EXPECT_EQ(cloud.patches().size(), 17U * 17U);
  for (const auto& p : cloud.patches()) EXPECT_EQ(p.position.z(), 4);
}

TEST(Filters, RegularityIsWhatDropsAPatchNearTheSurface) {
  const ViewGroup group = three_views();
  PatchCloud cloud = wall(group);
  cloud.add(patch_at(cloud, 0.04, 0.04, 4.2));  // too near to count as hidden
  EXPECT_EQ(filter(cloud, {.regularity = 0.25}).irregular, 1);
}

TEST(Filters, PatchesInFrontOfAnAgreedSurfaceAreDropped) {
  const ViewGroup group = three_views();
  PatchCloud cloud = wall(group);
  LivePatch ghost = patch_at(cloud, 0.0, 0.0, 2);
  ghost.score = 0.7;
  ghost.seen = 0b010;
  cloud.add(ghost);
  EXPECT_GE(filter(cloud, {}).in_front, 1);
  for (const auto& p : cloud.patches()) EXPECT_EQ(p.position.z(), 4);
}

TEST(Filters, SmallIslandsAreDropped) {
  const ViewGroup group = three_views();
  PatchCloud cloud(group, 4);
  for (int k = 0; k < 9; ++k) cloud.add(patch_at(cloud, 0.08 * k, 0.04, 4));
  EXPECT_EQ(filter(cloud, {.min_component = 10}).island, 9);
  EXPECT_TRUE(cloud.patches().empty());
}

TEST(Filters, PatchesThatMoveUnlikeTheirNeighboursAreDropped) {
  const ViewGroup group = three_views();
  PatchCloud cloud(group, 4);
  for (int row = -4; row <= 4; ++row)
    for (int col = -4; col <= 4; ++col) {
      LivePatch p = patch_at(cloud, 0.08 * col + 0.04, 0.08 * row + 0.04, 4);
      p.moves = true;
      p.velocity = {1 + 0.01 * col, 0, 0};
      if (row == 0 && col == 0) p.velocity = {-1, 0, 0};
      cloud.add(p);
    }
  EXPECT_EQ(filter(cloud, {}).velocity, 1);
  for (const auto& p : cloud.patches()) EXPECT_GT(p.velocity.x(), 0);
}

}  // namespace
}  // namespace vantage
