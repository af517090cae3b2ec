#include "jobs/views/depth_edges.h"

#include <algorithm>
#include <cmath>

#include "jobs/views/matched_edges.h"

namespace vantage {
namespace {

/// Exposures closer than this are of one moment: nothing moves a hundredth of a pixel meanwhile.
constexpr double kSameMoment_s = 1e-4;

}  // namespace

DepthEdges::DepthEdges(const Navspace& navspace, const Shot& shot)
    : navspace_(navspace), neighbours_(navspace.vertices.size()) {
  for (const ShotCamera& camera : shot.cameras)
    if (camera.moving) moving_.insert(camera.name);
  const MatchedEdges edges(navspace);
  for (const auto& [a, b] : edges.all()) {
    neighbours_[static_cast<std::size_t>(a)].push_back(b);
    neighbours_[static_cast<std::size_t>(b)].push_back(a);
  }
  for (auto& list : neighbours_) std::sort(list.begin(), list.end());
}

std::vector<DepthEdge> DepthEdges::of(int vertex) const {
  const NavVertex& image = navspace_.vertices[static_cast<std::size_t>(vertex)];
  std::vector<DepthEdge> edges;
  for (const int other : neighbours_[static_cast<std::size_t>(vertex)]) {
    const NavVertex& seen = navspace_.vertices[static_cast<std::size_t>(other)];
    if (seen.image.camera == image.image.camera && !moving_.contains(image.image.camera)) continue;
    const bool same_moment = std::abs(seen.time_s - image.time_s) < kSameMoment_s;
    edges.push_back({other, same_moment ? std::nullopt : step_towards(other, image.time_s)});
  }
  return edges;
}

/// The frame next to vertex on the side of time_s; else the one on the other side.
std::optional<int> DepthEdges::step_towards(int vertex, double time_s) const {
  const NavVertex& from = navspace_.vertices[static_cast<std::size_t>(vertex)];
  std::optional<int> best;
  double best_cost = 0;
  for (const int other : neighbours_[static_cast<std::size_t>(vertex)]) {
    const NavVertex& to = navspace_.vertices[static_cast<std::size_t>(other)];
    const double step_s = to.time_s - from.time_s;
    if (to.image.camera != from.image.camera || std::abs(step_s) < kSameMoment_s) continue;
    const bool wrong_side = step_s * (time_s - from.time_s) < 0;
    const double cost = std::abs(step_s) * (wrong_side ? 1.5 : 1.0);
    if (!best || cost < best_cost) {
      best = other;
      best_cost = cost;
    }
  }
  return best;
}

std::vector<int> DepthEdges::frames_around(int vertex, const std::set<int>& wanted) const {
  const NavVertex& from = navspace_.vertices[static_cast<std::size_t>(vertex)];
  std::optional<int> before, after;
  const auto time_of = [&](int v) { return navspace_.vertices[static_cast<std::size_t>(v)].time_s; };
  for (const int other : neighbours_[static_cast<std::size_t>(vertex)]) {
    const NavVertex& to = navspace_.vertices[static_cast<std::size_t>(other)];
    if (to.image.camera != from.image.camera || !wanted.contains(other)) continue;
    if (to.time_s < from.time_s && (!before || to.time_s > time_of(*before))) before = other;
    if (to.time_s > from.time_s && (!after || to.time_s < time_of(*after))) after = other;
  }
  std::vector<int> frames;
  if (before) frames.push_back(*before);
  if (after) frames.push_back(*after);
  return frames;
}

std::set<std::pair<int, int>> DepthEdges::needed_by(int vertex, const std::set<int>& wanted) const {
  std::set<std::pair<int, int>> edges;
  for (const DepthEdge& edge : of(vertex)) {
    edges.insert(std::minmax(vertex, edge.other));
    if (edge.step) edges.insert(std::minmax(edge.other, *edge.step));
  }
  for (const int frame : frames_around(vertex, wanted)) edges.insert(std::minmax(vertex, frame));
  return edges;
}

std::string correspond_job_name(const Navspace& navspace, int a, int b) {
  const auto label = [&](int vertex) { return navspace.vertices[static_cast<std::size_t>(vertex)].image.label(); };
  return "correspond/" + label(std::min(a, b)) + "__" + label(std::max(a, b));
}

}  // namespace vantage
