#pragma once
#include "schema/formats/navspace.h"

namespace vantage {

/// How the vertices of a navigation space vary, and how they were joined.
struct NavspaceReport {
  bool arc = false;     ///< the cameras' directions lie (nearly) on a line: one angle counts, the other was made equal
  bool ring = false;    ///< cameras stand all around: images at the seam are vertices twice, a turn apart
  bool frozen = false;  ///< all images are of one moment
  std::string cells;    ///< "columns", "delaunay" or "chain"
  bool crossing = false;       ///< cameras moved past each other: columns would overlap, so it became "delaunay"
  std::size_t num_unused = 0;  ///< vertices in no simplex
};

struct NavspaceOptions {
  std::string cells = "auto";  ///< "auto", "columns" or "delaunay"
  double arc_ratio = 0.15;
};

/// Joins the vertices of a space: fills simplices and edges, and on an arc sets the fixed angle of all vertices to its
/// mean, so that the space has one dimension less (Klose et al. 2011, §5.1). Vertices come camera by camera, each
/// camera's in order of time, azimuths unwrapped. One moment of an arc that is not quite level stays a surface of
/// triangles. Columns: a 2-D Delaunay triangulation of the cameras' mean directions (or their order along an arc),
/// swept through time. Delaunay: of all vertices, one second weighing as much as degrees_per_second says. Throws
/// Error(BadInput) when there are no two cameras, or nothing spans a simplex.
NavspaceReport join_vertices(Navspace& navspace, const NavspaceOptions& options);

}  // namespace vantage
