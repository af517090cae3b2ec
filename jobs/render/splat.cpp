#include "jobs/render/splat.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace vantage {
namespace {

constexpr double kTear_px = 3;
constexpr double kOnEdge = 1e-5;  ///< pixel centres on an edge belong to both triangles: no cracks

struct Corner {
  double x = 0, y = 0, z = 0;  ///< place in the view, px, and depth
  float u = 0, v = 0;          ///< pixel of the image
  float confidence = 0;
};

double length(const Corner& a, const Corner& b) { return std::hypot(a.x - b.x, a.y - b.y); }

class Rasteriser {
 public:
  Rasteriser(Layer& layer, double scale) : layer_(layer), scale_(scale) {}

  void draw(const Corner& a, const Corner& b, const Corner& c) {
    if (a.z <= 0 || b.z <= 0 || c.z <= 0) return;
    const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (!(area > 1e-9)) return;
    const double longest = std::max({length(a, b), length(b, c), length(c, a)});
    const double stretch_px = longest - std::numbers::sqrt2 * scale_;
    if (stretch_px > kTear_px * std::max(1.0, scale_)) return;
    const auto fade = static_cast<float>(1 / (1 + 4 * std::pow(std::max(0.0, stretch_px), 2)));
    fill(a, b, c, area, fade * std::min({a.confidence, b.confidence, c.confidence}));
  }

 private:
  void fill(const Corner& a, const Corner& b, const Corner& c, double area, float confidence) {
    const int x0 = std::max(0, static_cast<int>(std::ceil(std::min({a.x, b.x, c.x}) - 0.5 - kOnEdge)));
    const int x1 = std::min(layer_.z.cols - 1, static_cast<int>(std::floor(std::max({a.x, b.x, c.x}) - 0.5 + kOnEdge)));
    const int y0 = std::max(0, static_cast<int>(std::ceil(std::min({a.y, b.y, c.y}) - 0.5 - kOnEdge)));
    const int y1 = std::min(layer_.z.rows - 1, static_cast<int>(std::floor(std::max({a.y, b.y, c.y}) - 0.5 + kOnEdge)));
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) {
        const double px = x + 0.5, py = y + 0.5;
        const double wa = ((b.x - px) * (c.y - py) - (b.y - py) * (c.x - px)) / area;
        const double wb = ((c.x - px) * (a.y - py) - (c.y - py) * (a.x - px)) / area;
        const double wc = 1 - wa - wb;
        if (wa < -kOnEdge || wb < -kOnEdge || wc < -kOnEdge) continue;
        const auto z = static_cast<float>(wa * a.z + wb * b.z + wc * c.z);
        float& nearest = layer_.z(y, x);
        if (nearest > 0 && z >= nearest) continue;
        nearest = z;
        layer_.source_px(y, x) = {static_cast<float>(wa * a.u + wb * b.u + wc * c.u),
                                  static_cast<float>(wa * a.v + wb * b.v + wc * c.v)};
        layer_.confidence(y, x) = confidence;
      }
  }

  Layer& layer_;
  double scale_;
};

Corner corner_of(const PixelPlaces& places, int x, int y, const ViewCamera& view) {
  const cv::Vec3d& w = places.world(y, x);
  const Eigen::Vector3d p = view.cam_from_world * Eigen::Vector3d(w[0], w[1], w[2]);
  Corner corner;
  corner.z = p.z();
  if (p.z() <= 1e-9) return corner;
  const Eigen::Vector2d px = view.pinhole.project(p);
  corner.x = px.x() + (view.disparity ? view.disparity->shift_px(p.z()) : 0);
  corner.y = px.y();
  corner.u = static_cast<float>(x) + 0.5F;
  corner.v = static_cast<float>(y) + 0.5F;
  corner.confidence = places.confidence(y, x);
  return corner;
}

}  // namespace

Layer splat(const PixelPlaces& places, const ViewCamera& view, double expected_scale) {
  const cv::Size size(view.pinhole.width, view.pinhole.height);
  Layer layer{cv::Mat2f(size, cv::Vec2f(0, 0)), cv::Mat1f(size, 0.0F), cv::Mat1f(size, 0.0F)};
  Rasteriser rasteriser(layer, expected_scale);
  std::vector<Corner> above, row;
  for (int y = 0; y < places.world.rows; ++y) {
    row.clear();
    for (int x = 0; x < places.world.cols; ++x) row.push_back(corner_of(places, x, y, view));
    for (std::size_t x = 1; y > 0 && x < row.size(); ++x) {
      rasteriser.draw(above[x - 1], above[x], row[x - 1]);
      rasteriser.draw(above[x], row[x], row[x - 1]);
    }
    above.swap(row);
  }
  return layer;
}

}  // namespace vantage
