#include "jobs/views/view_images.h"

#include <algorithm>
#include <cmath>

namespace vantage {
namespace {
constexpr double kSameTime_s = 1e-6;
/// Of the most edges that a camera has with another: fewer join cameras that are not beside each other, at the ends of
/// the footage only, where nearer ones have no images.
constexpr double kBeside = 0.25;
}  // namespace

ViewImages::ViewImages(const Navspace& navspace) : navspace_(navspace) {
  const auto& vertices = navspace.vertices;
  std::set<int> joined;
  std::map<std::string, std::map<std::string, int>> num_edges;
  for (const auto& [i, k] : navspace.edges) {
    const std::string& a = vertices[static_cast<std::size_t>(i)].image.camera;
    const std::string& b = vertices[static_cast<std::size_t>(k)].image.camera;
    if (a == b) continue;
    joined.insert({i, k});
    ++num_edges[a][b];
    ++num_edges[b][a];
  }
  for (const int v : joined) frames_[vertices[static_cast<std::size_t>(v)].image.camera].push_back(v);
  for (auto& [camera, list] : frames_)
    std::stable_sort(list.begin(), list.end(), [&](int a, int b) {
      return vertices[static_cast<std::size_t>(a)].time_s < vertices[static_cast<std::size_t>(b)].time_s;
    });
  for (const auto& [camera, others] : num_edges) {
    int most = 0;
    for (const auto& [other, count] : others) most = std::max(most, count);
    for (const auto& [other, count] : others)
      if (kBeside * most <= count) neighbours_[camera].insert(other);
  }
}

std::vector<int> ViewImages::around(const std::vector<NavLocation>& locations, double time_s) const {
  std::set<std::string> cameras;
  std::set<int> images;
  for (const NavLocation& location : locations) {
    images.insert(location.vertices.begin(), location.vertices.end());
    add_cameras_of(location, cameras);
  }
  for (const std::string& camera : cameras) add_frames_of(camera, time_s, images);
  return {images.begin(), images.end()};
}

void ViewImages::add_cameras_of(const NavLocation& location, std::set<std::string>& cameras) const {
  std::set<std::string> inner;
  for (const int v : location.vertices) inner.insert(navspace_.vertices[static_cast<std::size_t>(v)].image.camera);
  std::set<std::string> all = with_neighbours(inner, std::max<std::size_t>(1, inner.size() - 1));
  // Two cameras, as on an arc, have only one beside them on either side: the next ones see behind things, too.
  if (inner.size() <= 2) all = with_neighbours(all, 1);
  cameras.merge(all);
}

std::set<std::string> ViewImages::with_neighbours(const std::set<std::string>& cameras, std::size_t min_joins) const {
  std::map<std::string, std::size_t> joins;
  for (const std::string& camera : cameras)
    if (const auto found = neighbours_.find(camera); found != neighbours_.end())
      for (const std::string& other : found->second) ++joins[other];
  std::set<std::string> all = cameras;
  for (const auto& [camera, count] : joins)
    if (count >= min_joins) all.insert(camera);
  return all;
}

void ViewImages::add_frames_of(const std::string& camera, double time_s, std::set<int>& images) const {
  const std::vector<int>& list = frames_.at(camera);
  const auto time_of = [&](int v) { return navspace_.vertices[static_cast<std::size_t>(v)].time_s; };
  const auto after =
      std::lower_bound(list.begin(), list.end(), time_s - kSameTime_s, [&](int v, double t) { return time_of(v) < t; });
  if (after != list.end() && std::abs(time_of(*after) - time_s) <= kSameTime_s) {
    images.insert(*after);
    return;
  }
  const auto count = static_cast<std::ptrdiff_t>(list.size());
  const std::ptrdiff_t first =
      std::clamp<std::ptrdiff_t>(after - list.begin() - 1, 0, std::max<std::ptrdiff_t>(0, count - 2));
  for (std::ptrdiff_t k = first; k < std::min(first + 2, count); ++k) images.insert(list[static_cast<std::size_t>(k)]);
}

}  // namespace vantage
