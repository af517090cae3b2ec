#include "jobs/views/matched_edges.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

namespace vantage {
namespace {

/// A camera is in between two others when the way over it is at most so much longer than the straight one, and each
/// part of it at most this share of the straight one.
constexpr double kDetour = 1.1, kLongestPart = 0.8;

struct Direction {
  double azimuth_deg = 0, elevation_deg = 0;
};

double angle_deg(const Direction& a, const Direction& b) {
  const double turn = std::remainder(a.azimuth_deg - b.azimuth_deg, 360);
  const double level = std::cos(0.5 * (a.elevation_deg + b.elevation_deg) * std::numbers::pi / 180);
  return std::hypot(level * turn, a.elevation_deg - b.elevation_deg);
}

/// Of each camera's first image: cameras that stand, or hold their place roughly.
std::map<std::string, Direction> directions_of(const Navspace& navspace) {
  std::map<std::string, Direction> directions;
  for (const NavVertex& v : navspace.vertices)
    directions.emplace(v.image.camera, Direction{v.azimuth_deg, v.elevation_deg});
  return directions;
}

bool has_camera_between(const std::string& a, const std::string& b, const std::map<std::string, Direction>& all) {
  const Direction from = all.at(a), to = all.at(b);
  const double straight = angle_deg(from, to);
  return std::ranges::any_of(all, [&](const auto& camera) {
    if (camera.first == a || camera.first == b) return false;
    const double first = angle_deg(from, camera.second), second = angle_deg(camera.second, to);
    return first + second <= kDetour * straight && std::max(first, second) <= kLongestPart * straight;
  });
}

}  // namespace

MatchedEdges::MatchedEdges(const Navspace& navspace) : later_(navspace.vertices.size()) {
  const auto directions = directions_of(navspace);
  std::map<std::pair<std::string, std::string>, bool> matched;
  for (const Edge& edge : navspace.edges) {
    const std::string& a = navspace.vertices[static_cast<std::size_t>(edge.first)].image.camera;
    const std::string& b = navspace.vertices[static_cast<std::size_t>(edge.second)].image.camera;
    const auto [found, is_new] = matched.try_emplace(std::minmax(a, b), true);
    if (is_new) found->second = a == b || !has_camera_between(a, b, directions);
    if (!found->second) continue;
    edges_.push_back(edge);
    later_[static_cast<std::size_t>(edge.first)].push_back(edge.second);
  }
}

std::vector<MatchedEdges::Edge> MatchedEdges::among(const std::vector<int>& vertices) const {
  std::vector<Edge> edges;
  for (const int first : vertices)
    for (const int second : later_[static_cast<std::size_t>(first)])
      if (std::ranges::binary_search(vertices, second)) edges.emplace_back(first, second);
  return edges;
}

}  // namespace vantage
