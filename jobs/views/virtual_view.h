#pragma once
/// From a [[render]] to virtual cameras, and which recorded images each needs. Light: the scheduler plans with it, the
/// render kind draws with it.
#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "jobs/views/stereo_plan.h"
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
/// For many points make a NavLocator (nav_locator.h).
NavLocation locate(const Navspace& navspace, const NavPoint& point);

/// One picture to draw.
struct VirtualEye {
  std::string name;  ///< "", or "left" and "right"
  Pinhole pinhole;   ///< stereo: centre shifted so that points at the convergence distance coincide
  RigidTransform cam_from_world;
  NavLocation location;   ///< the images to interpolate
  double shift_sign = 0;  ///< mode "stereo-depth": the camera is the middle one, things are shifted by their disparity
                          ///< (DisparityRule): +1 left, -1 right; 0: not shifted
};

/// One output frame to be.
struct VirtualView {
  int frame = 0;
  double time_s = 0;
  Pinhole pinhole;
  RigidTransform cam_from_world;  ///< stereo: the middle camera
  std::optional<StereoPlan> stereo;
  NavPoint nav;
  NavLocation location;          ///< the images to interpolate (of the middle camera)
  std::vector<VirtualEye> eyes;  ///< one, or two
  std::vector<int> images;  ///< all vertices that rendering reads, rising: of the cameras of the cell and those beside
                            ///< it, the frames just before and after time_s
};

/// All frames of a request, in order of their number. Key frames: at_s × fps, interpolated, camera on the surface that
/// the cameras span (radius, and elevation on an arc, are interpolated), looking at the centre with level horizon;
/// where the path leaves the hull it follows the hull. views.json: its poses, brought into the calibration's world by
/// its anchors. Size and field of view: the first camera's size and the cameras' mean field of view where the request
/// says none.
std::vector<VirtualView> virtual_views(const RenderRequest& request, const Shot& shot, const Calibration& calibration,
                                       const Navspace& navspace);

/// What all renders of a shot read, with the number of the first view that does, counted over all renders in their
/// order: what is needed first is to be made first.
struct RenderNeeds {
  std::map<std::pair<int, int>, std::size_t> edges;  ///< vertices, first < second: maps between a view's images
  std::map<int, std::size_t> depths;                 ///< vertices whose depth is read
};
RenderNeeds render_needs(const Shot& shot, const Calibration& calibration, const Navspace& navspace);

/// The keys in the order of their numbers; equal numbers by key.
template <class Key>
std::vector<Key> by_first_use(const std::map<Key, std::size_t>& first_use) {
  std::vector<Key> keys;
  for (const auto& [key, number] : first_use) keys.push_back(key);
  std::ranges::stable_sort(keys, {}, [&](const Key& key) { return first_use.at(key); });
  return keys;
}

}  // namespace vantage
