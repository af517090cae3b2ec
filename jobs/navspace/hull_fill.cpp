#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "jobs/navspace/columns.h"

namespace vantage {
namespace {

constexpr double kFlat = 1e-9;  ///< of the product of the extents: simplices flatter than this count as none

using Triangle = std::array<int, 3>;

/// Twice the signed area.
double area2(const Place& a, const Place& b, const Place& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// An arc: the chain of heights over x becomes its lower hull, each point that is dropped leaves a triangle.
std::vector<std::vector<int>> fill_chain(const std::vector<std::vector<int>>& base, const std::vector<Place>& places,
                                         const std::vector<double>& heights, double flat) {
  std::vector<int> chain{base.front().front()};
  for (const auto& pair : base) chain.push_back(pair[1]);
  const auto at = [&](int k) {
    return Place{places[static_cast<std::size_t>(k)].x, heights[static_cast<std::size_t>(k)]};
  };
  std::vector<std::vector<int>> cells;
  std::vector<int> hull;
  for (const int camera : chain) {
    while (hull.size() >= 2) {
      const int a = hull[hull.size() - 2], b = hull.back();
      const double turn = area2(at(a), at(b), at(camera));
      if (turn > flat) break;  // b is a corner of the lower hull so far
      if (turn < -flat) cells.push_back({a, b, camera});
      hull.pop_back();
    }
    hull.push_back(camera);
  }
  return cells;
}

/// A surface of triangles over the plane that is flipped, simplex by simplex, into its lower hull.
class Surface {
 public:
  Surface(std::vector<Triangle> triangles, const std::vector<Place>& places, const std::vector<double>& heights,
          double flat)
      : triangles_(std::move(triangles)), places_(places), heights_(heights), flat_(flat) {
    for (Triangle& t : triangles_)
      if (area2(at(t[0]), at(t[1]), at(t[2])) < 0) std::swap(t[1], t[2]);
  }

  /// Each flip lowers the surface, so this ends.
  std::vector<std::vector<int>> lower() {
    std::vector<std::vector<int>> cells;
    while (const auto cell = flip_one()) cells.push_back(*cell);
    return cells;
  }

 private:
  const Place& at(int k) const { return places_[static_cast<std::size_t>(k)]; }

  std::optional<std::vector<int>> flip_one() {
    for (std::size_t s = 0; s < triangles_.size(); ++s)
      for (std::size_t t = s + 1; t < triangles_.size(); ++t)
        for (int side = 0; side < 3; ++side) {
          const int a = triangles_[s][static_cast<std::size_t>(side)],
                    b = triangles_[s][static_cast<std::size_t>((side + 1) % 3)];
          const int c = triangles_[s][static_cast<std::size_t>((side + 2) % 3)];
          const std::optional<int> d = opposite(triangles_[t], b, a);
          if (!d || height_over(a, b, c, *d) > -flat_) continue;
          if (flip_edge(s, t, a, b, c, *d) || drop_corner(a, b, c, *d) || drop_corner(b, a, c, *d))
            return std::vector<int>{a, b, c, *d};
        }
    return std::nullopt;
  }

  /// Third corner of a triangle that has the directed edge from → to.
  static std::optional<int> opposite(const Triangle& t, int from, int to) {
    for (std::size_t k = 0; k < 3; ++k)
      if (t[k] == from && t[(k + 1) % 3] == to) return t[(k + 2) % 3];
    return std::nullopt;
  }

  /// Six times the volume of a, b, c, d; negative when d is below the plane of a, b, c (counter-clockwise).
  double height_over(int a, int b, int c, int d) const {
    const double abc = area2(at(a), at(b), at(c)), abd = area2(at(a), at(b), at(d));
    const double bcd = area2(at(b), at(c), at(d)), cad = area2(at(c), at(a), at(d));
    const auto h = [&](int k) { return heights_[static_cast<std::size_t>(k)]; };
    return abc * h(d) - (bcd * h(a) + cad * h(b) + abd * h(c));
  }

  /// Edge ab becomes cd, when the four are convex.
  bool flip_edge(std::size_t s, std::size_t t, int a, int b, int c, int d) {
    if (area2(at(c), at(d), at(b)) <= flat_ || area2(at(d), at(c), at(a)) <= flat_) return false;
    triangles_[s] = {c, d, b};
    triangles_[t] = {d, c, a};
    return true;
  }

  /// Corner a, which lies inside b, c, d and has no other triangle, leaves the surface.
  bool drop_corner(int a, int b, int c, int d) {
    Triangle rest{b, c, d};
    if (area2(at(b), at(c), at(d)) < 0) std::swap(rest[1], rest[2]);
    std::vector<std::size_t> around;
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      if (std::count(triangles_[t].begin(), triangles_[t].end(), a) > 0) around.push_back(t);
    const bool inside = area2(at(rest[0]), at(rest[1]), at(a)) > flat_ &&
                        area2(at(rest[1]), at(rest[2]), at(a)) > flat_ &&
                        area2(at(rest[2]), at(rest[0]), at(a)) > flat_;
    if (around.size() != 3 || !inside) return false;
    triangles_[around[0]] = rest;
    triangles_.erase(triangles_.begin() + static_cast<std::ptrdiff_t>(around[2]));
    triangles_.erase(triangles_.begin() + static_cast<std::ptrdiff_t>(around[1]));
    return true;
  }

  std::vector<Triangle> triangles_;
  const std::vector<Place>& places_;
  const std::vector<double>& heights_;
  double flat_;
};

}  // namespace

std::vector<std::vector<int>> fill_to_hull(const std::vector<std::vector<int>>& base, const std::vector<Place>& places,
                                           const std::vector<double>& heights) {
  if (base.empty()) return {};
  const auto [x0, x1] = std::minmax_element(places.begin(), places.end(), [](auto& a, auto& b) { return a.x < b.x; });
  const auto [y0, y1] = std::minmax_element(places.begin(), places.end(), [](auto& a, auto& b) { return a.y < b.y; });
  const auto [h0, h1] = std::minmax_element(heights.begin(), heights.end());
  const double height = std::max(*h1 - *h0, 1e-12);
  if (base.front().size() == 2) return fill_chain(base, places, heights, kFlat * (x1->x - x0->x) * height);
  std::vector<Triangle> triangles;
  for (const auto& cell : base) triangles.push_back({cell[0], cell[1], cell[2]});
  const double flat = kFlat * (x1->x - x0->x) * (y1->y - y0->y) * std::max(1.0, height);
  return Surface(std::move(triangles), places, heights, flat).lower();
}

}  // namespace vantage
