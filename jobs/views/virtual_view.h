#pragma once
/// From a [[render]] to virtual cameras, and which recorded images each needs. Light: the scheduler plans with it, the
/// render kind draws with it.
#include <optional>
#include <utility>
#include <vector>

#include "schema/formats/calibration.h"
#include "schema/formats/navspace.h"
#include "schema/formats/views_file.h"
#include "schema/shot/shot.h"

namespace vantage {

/// A position in the navigation space.
struct NavPoint {
  double azimuth_deg = 0, elevation_deg = 0, time_s = 0;
};

/// Where a point lies in the space: the simplex's images and their barycentric weights (≥ 0, sum 1).
struct NavLocation {
  std::vector<int> vertices;    ///< indices into Navspace::vertices
  std::vector<double> weights;  ///< same order
  bool outside = false;         ///< the point was outside the hull and was moved to the nearest place inside
};
NavLocation locate(const Navspace& navspace, const NavPoint& point);

/// One output frame to be.
struct VirtualView {
  int frame = 0;
  double time_s = 0;
  Pinhole pinhole;
  RigidTransform cam_from_world;    ///< stereo: the middle camera
  std::optional<double> baseline;   ///< stereo, explicit: world units
  NavPoint nav;
  NavLocation location;             ///< the images to interpolate (of the middle camera)
  std::vector<int> images;          ///< all vertices that rendering reads: location's, and neighbours for both eyes and holes
};

/// All frames of a request, in order of their number. Key frames: at_s × fps, interpolated, camera on the sphere looking
/// at its centre. views.json: its poses, brought into the calibration's world by its anchors.
/// first_camera gives size and focal length where the request says none.
std::vector<VirtualView> virtual_views(const RenderRequest& request, const Shot& shot, const Calibration& calibration,
                                       const Navspace& navspace);

/// Edges (pairs of vertices, first < second) that the views' images have between them.
std::vector<std::pair<int, int>> edges_of_views(const std::vector<VirtualView>& views, const Navspace& navspace);

}  // namespace vantage
