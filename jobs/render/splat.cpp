#include "jobs/render/splat.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "jobs/vision/vector_clones.h"

namespace vantage {
namespace {

constexpr float kTear_px = 3;
constexpr float kOnEdge = 1e-3F;  ///< pixel centres on an edge belong to both triangles: no cracks
constexpr float kMinArea = 1e-6F;

/// What the two triangles (a b c) and (b d c) of each cell between two rows of pixels are worth: 0 for those that turn
/// over, tear or lie behind the view. Corners: a b above, c d below.
struct CellRow {
  std::vector<float> area1, area2, confidence1, confidence2;
  explicit CellRow(std::size_t cells) : area1(cells), area2(cells), confidence1(cells), confidence2(cells) {}
};

inline float squared(float dx, float dy) { return dx * dx + dy * dy; }

/// Full worth up to an edge of √2 pixels, falling with the square of what it is longer, nothing from the tear on.
inline float worth(float area, float longest2, float scale, float least) {
  const float stretch_px = std::max(0.0F, std::sqrt(longest2) - 1.41421356F * scale);
  const float fade = 1 / (1 + 4 * stretch_px * stretch_px);
  const bool drawn = area > kMinArea && stretch_px <= kTear_px * std::max(1.0F, scale);
  return drawn ? fade * least : 0.0F;
}

VANTAGE_VECTOR_CLONES
void judge_cells(const float* ax, const float* ay, const float* az, const float* ac, const float* cx, const float* cy,
                 const float* cz, const float* cc, std::size_t cells, float scale, float* area1, float* area2,
                 float* confidence1, float* confidence2) {
  for (std::size_t k = 0; k < cells; ++k) {
    const float abx = ax[k + 1] - ax[k], aby = ay[k + 1] - ay[k];
    const float acx = cx[k] - ax[k], acy = cy[k] - ay[k];
    const float bcx = cx[k] - ax[k + 1], bcy = cy[k] - ay[k + 1];
    const float bdx = cx[k + 1] - ax[k + 1], bdy = cy[k + 1] - ay[k + 1];
    const float cdx = cx[k + 1] - cx[k], cdy = cy[k + 1] - cy[k];
    const float diagonal = squared(bcx, bcy);
    area1[k] = abx * acy - aby * acx;
    area2[k] = bdx * bcy - bdy * bcx;
    const float long1 = std::max(diagonal, std::max(squared(abx, aby), squared(acx, acy)));
    const float long2 = std::max(diagonal, std::max(squared(bdx, bdy), squared(cdx, cdy)));
    const float front = std::min(az[k + 1], cz[k]), shared = std::min(ac[k + 1], cc[k]);
    const float worth1 = worth(area1[k], long1, scale, std::min(ac[k], shared));
    const float worth2 = worth(area2[k], long2, scale, std::min(cc[k + 1], shared));
    confidence1[k] = std::min(az[k], front) > 0 ? worth1 : 0.0F;
    confidence2[k] = std::min(cz[k + 1], front) > 0 ? worth2 : 0.0F;
  }
}

struct Corner {
  float x, y, z, order;
  float u, v;  ///< pixel of the image
};

/// First and last pixel whose centre lies between two coordinates.
inline int first_centre(float low) {
  const float index = low - 0.5F - kOnEdge;
  if (!(index > 0)) return 0;
  const int whole = static_cast<int>(index);
  return whole + (index > static_cast<float>(whole) ? 1 : 0);
}
inline int last_centre(float high, int size) {
  const float index = high - 0.5F + kOnEdge;
  if (!(index >= 0)) return -1;
  return index >= static_cast<float>(size - 1) ? size - 1 : static_cast<int>(index);
}

/// Draws triangles into a layer, the nearest on top, of equally near ones the first.
class Rasteriser {
 public:
  explicit Rasteriser(Layer& layer) : layer_(layer) {}

  void draw(const Corner& a, const Corner& b, const Corner& c, float area, float confidence) {
    const int x0 = first_centre(std::min(std::min(a.x, b.x), c.x));
    const int x1 = last_centre(std::max(std::max(a.x, b.x), c.x), layer_.z.cols);
    if (x0 > x1) return;
    const int y0 = first_centre(std::min(std::min(a.y, b.y), c.y));
    const int y1 = last_centre(std::max(std::max(a.y, b.y), c.y), layer_.z.rows);
    if (y0 > y1) return;
    const float inverse = 1 / area;
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) {
        const float px = static_cast<float>(x) + 0.5F, py = static_cast<float>(y) + 0.5F;
        const float wa = ((b.x - px) * (c.y - py) - (b.y - py) * (c.x - px)) * inverse;
        const float wb = ((c.x - px) * (a.y - py) - (c.y - py) * (a.x - px)) * inverse;
        const float wc = 1 - wa - wb;
        if (wa < -kOnEdge || wb < -kOnEdge || wc < -kOnEdge) continue;
        const float order = wa * a.order + wb * b.order + wc * c.order;
        float& nearest = layer_.order(y, x);
        if (nearest > 0 && order >= nearest) continue;
        nearest = order;
        layer_.z(y, x) = wa * a.z + wb * b.z + wc * c.z;
        layer_.source_px(y, x) = {wa * a.u + wb * b.u + wc * c.u, wa * a.v + wb * b.v + wc * c.v};
        layer_.confidence(y, x) = confidence;
      }
  }

 private:
  Layer& layer_;
};

inline Corner corner(const PlacedRow& row, std::size_t x, int y) {
  return {row.x[x],
          row.y[x],
          row.z[x],
          row.order[x],
          static_cast<float>(static_cast<int>(x)) + 0.5F,
          static_cast<float>(y) + 0.5F};
}

void draw_cells(Rasteriser& rasteriser, const PlacedRow& above, const PlacedRow& row, int y, const CellRow& cells) {
  for (std::size_t k = 0; k < cells.area1.size(); ++k) {
    const float confidence1 = cells.confidence1[k], confidence2 = cells.confidence2[k];
    if (confidence1 <= 0 && confidence2 <= 0) continue;
    const Corner b = corner(above, k + 1, y - 1), c = corner(row, k, y);
    if (confidence1 > 0) rasteriser.draw(corner(above, k, y - 1), b, c, cells.area1[k], confidence1);
    if (confidence2 > 0) rasteriser.draw(b, corner(row, k + 1, y), c, cells.area2[k], confidence2);
  }
}

}  // namespace

Layer splat(const PixelPlaces& places, cv::Size view_size, double expected_scale) {
  Layer layer{cv::Mat2f(view_size, cv::Vec2f(0, 0)), cv::Mat1f(view_size, 0.0F), cv::Mat1f(view_size, 0.0F),
              cv::Mat1f(view_size, 0.0F)};
  const cv::Size size = places.size();
  if (size.width < 2) return layer;
  Rasteriser rasteriser(layer);
  PlacedRow above(size.width), row(size.width);
  CellRow cells(static_cast<std::size_t>(size.width - 1));
  for (int y = 0; y < size.height; ++y) {
    places.row(y, row);
    if (y > 0) {
      judge_cells(above.x.data(), above.y.data(), above.z.data(), above.confidence.data(), row.x.data(), row.y.data(),
                  row.z.data(), row.confidence.data(), cells.area1.size(), static_cast<float>(expected_scale),
                  cells.area1.data(), cells.area2.data(), cells.confidence1.data(), cells.confidence2.data());
      draw_cells(rasteriser, above, row, y, cells);
    }
    std::swap(above, row);
  }
  return layer;
}

}  // namespace vantage
