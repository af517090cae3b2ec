#include "jobs/views/matched_edges.h"

#include <gtest/gtest.h>

namespace vantage {
namespace {

/// One image each of cameras at these azimuths and elevations, all joined to all.
Navspace space_of(const std::vector<std::pair<double, double>>& directions) {
  Navspace n;
  for (std::size_t c = 0; c < directions.size(); ++c) {
    n.vertices.push_back({{"cam" + std::to_string(c), 0}, directions[c].first, directions[c].second, 0});
    for (std::size_t k = 0; k < c; ++k) n.edges.emplace_back(static_cast<int>(k), static_cast<int>(c));
  }
  return n;
}

using Edges = std::vector<MatchedEdges::Edge>;

TEST(MatchedEdges, CamerasOfAnArcAreMatchedToTheNextOnesOnly) {
  const MatchedEdges edges(space_of({{-20, 1}, {-8, 0}, {0, 1}, {13, 0}}));
  EXPECT_EQ(edges.among({0, 1, 2, 3}), (Edges{{0, 1}, {1, 2}, {2, 3}}));
}

TEST(MatchedEdges, AcrossARingsSeamToo) {
  const MatchedEdges edges(space_of({{-170, 0}, {-130, 0}, {150, 0}, {100, 0}}));
  EXPECT_EQ(edges.among({0, 1, 2}), (Edges{{0, 1}, {0, 2}}));
}

TEST(MatchedEdges, SidesAndDiagonalsOfAGridAreMatched) {
  const MatchedEdges edges(space_of({{0, 0}, {10, 0}, {0, 10}, {10, 10}}));
  EXPECT_EQ(edges.all().size(), 6U);
}

TEST(MatchedEdges, AFarCameraWithNoneInBetweenIsMatched) {
  const MatchedEdges edges(space_of({{0, 0}, {5, 0}, {60, 0}}));
  EXPECT_EQ(edges.all().size(), 3U);
}

TEST(MatchedEdges, FramesOfOneCameraAreMatched) {
  Navspace n = space_of({{0, 0}, {10, 0}});
  n.vertices[1].image = {"cam0", 1};
  EXPECT_EQ(MatchedEdges(n).all().size(), 1U);
}

}  // namespace
}  // namespace vantage
