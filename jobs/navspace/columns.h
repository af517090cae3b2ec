#pragma once
/// Cells between columns of images: a column is one camera's images in order of time. A cell of neighbouring cameras
/// (two on an arc, three that form a base triangle) is swept through time: the column whose next image comes first
/// advances, and the old front with the new image is a simplex. What a wall between two columns looks like depends on
/// these two alone, so neighbouring cells always meet, and no simplex spans more than one image interval of any camera.
#include <utility>
#include <vector>

namespace vantage {

/// times_s of the images of each camera (rising), by camera; images are named (camera, number in the column).
using ColumnTimes = std::vector<std::vector<double>>;
struct ColumnImage {
  int camera = 0, number = 0;
  auto operator<=>(const ColumnImage&) const = default;
};
using ColumnSimplex = std::vector<ColumnImage>;

/// cameras: two or three. Equal times advance in order of the camera's number.
std::vector<ColumnSimplex> sweep(const std::vector<int>& cameras, const ColumnTimes& times_s);

/// The gap between a surface of first images (or last ones) and the convex hull: cameras that start late leave a dent,
/// which simplices of their earlier neighbours fill. Found by flips of the surface's edges towards the hull; where
/// flips get stuck a rest stays open. places: of cameras, degrees: (azimuth, elevation), or (azimuth, 0) on an arc.
/// heights: of the surface, in seconds, first images' times to fill below, minus the last images' times to fill above.
/// base: the cells' cameras: pairs that follow each other along the arc, or triangles. Returns simplices of cameras.
struct Place {
  double x = 0, y = 0;
};
std::vector<std::vector<int>> fill_to_hull(const std::vector<std::vector<int>>& base, const std::vector<Place>& places,
                                           const std::vector<double>& heights);

}  // namespace vantage
