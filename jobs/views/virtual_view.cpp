#include "jobs/views/virtual_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "jobs/views/key_frames.h"
#include "jobs/views/matched_edges.h"
#include "jobs/views/nav_locator.h"
#include "jobs/views/render_options.h"
#include "jobs/views/similarity.h"
#include "jobs/views/sphere.h"
#include "jobs/views/view_images.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// Size as asked for, or the first camera's; the mean field of view of all cameras, so that a path does not zoom.
Pinhole path_pinhole(const RenderRequest& request, const Shot& shot, const Calibration& calibration) {
  check(!calibration.cameras.empty(), "a calibration has cameras");
  Pinhole first = calibration.cameras.begin()->second.pinhole;
  for (auto camera = shot.cameras.rbegin(); camera != shot.cameras.rend(); ++camera)
    if (const auto found = calibration.cameras.find(camera->name); found != calibration.cameras.end())
      first = found->second.pinhole;
  Pinhole p = first;
  if (request.width > 0) p.width = request.width;
  if (request.height > 0) p.height = request.height;
  if (request.width > 0 && request.height == 0)
    p.height = static_cast<int>(std::lround(1.0 * p.width * first.height / first.width));
  if (request.height > 0 && request.width == 0)
    p.width = static_cast<int>(std::lround(1.0 * p.height * first.width / first.height));
  double focal_per_width = 0;
  for (const auto& [name, camera] : calibration.cameras) focal_per_width += camera.pinhole.fx / camera.pinhole.width;
  p.fx = p.fy = focal_per_width / static_cast<double>(calibration.cameras.size()) * p.width;
  p.cx = 0.5 * p.width;
  p.cy = 0.5 * p.height;
  return p;
}

/// Makes the views of one request.
class Planner {
 public:
  Planner(const RenderRequest& request, const Shot& shot, const Calibration& calibration, const Navspace& navspace)
      : request_(request),
        shot_(shot),
        calibration_(calibration),
        navspace_(navspace),
        options_(render_options(request)),
        locator_(navspace),
        images_(navspace) {
    for (const NavVertex& v : navspace.vertices) {
      recorded_.push_back(sphere_point(navspace, calibration.pose(v.image).centre()));
      SpherePoint& place = recorded_.back();  // unwrap like the vertex
      place.azimuth_deg += 360 * std::round((v.azimuth_deg - place.azimuth_deg) / 360);
    }
  }

  std::vector<VirtualView> plan() const {
    std::vector<VirtualView> views = request_.views.empty() ? along_path() : from_file();
    std::sort(views.begin(), views.end(), [](const auto& a, const auto& b) { return a.frame < b.frame; });
    for (VirtualView& view : views) {
      add_eyes(view);
      std::vector<NavLocation> locations{view.location};
      for (const VirtualEye& eye : view.eyes) locations.push_back(eye.location);
      view.images = images_.around(locations, view.time_s);
    }
    add_knots(views);
    return views;
  }

 private:
  std::vector<VirtualView> along_path() const {
    std::vector<VirtualView> views;
    const Pinhole pinhole = path_pinhole(request_, shot_, calibration_);
    for (const int frame : path_frames(request_.keyframes, request_.fps)) {
      const KeyFrame key = path_at(request_.keyframes, frame / request_.fps);
      VirtualView view;
      view.frame = frame;
      view.pinhole = pinhole;
      view.location = locator_.locate({key.azimuth_deg, key.elevation_deg, key.time_s});
      const SpherePoint place = place_on_surface(view.location, view.time_s);
      view.nav = {place.azimuth_deg, place.elevation_deg, view.time_s};
      view.cam_from_world = look_at(world_point(navspace_, place), navspace_.centre, navspace_.axes.row(1).transpose());
      if (request_.mode != "view") view.stereo = stereo_of(view, std::nullopt);
      views.push_back(std::move(view));
    }
    return views;
  }

  /// The place that a location's weights stand for, on the surface through the recorded cameras.
  SpherePoint place_on_surface(const NavLocation& location, double& time_s) const {
    SpherePoint place;
    time_s = 0;
    for (std::size_t k = 0; k < location.vertices.size(); ++k) {
      const auto v = static_cast<std::size_t>(location.vertices[k]);
      const double w = location.weights[k];
      const double first_deg = recorded_[static_cast<std::size_t>(location.vertices[0])].azimuth_deg;
      const double turns = std::round((first_deg - recorded_[v].azimuth_deg) / 360);  // across a ring's seam
      place.azimuth_deg += w * (recorded_[v].azimuth_deg + 360 * turns);
      place.elevation_deg += w * recorded_[v].elevation_deg;
      place.radius += w * recorded_[v].radius;
      time_s += w * navspace_.vertices[v].time_s;
    }
    return place;
  }

  std::vector<VirtualView> from_file() const {
    const std::filesystem::path path = shot_.folder / request_.views;
    if (!std::filesystem::is_regular_file(path))
      throw Error(ErrorKind::BadInput, fmt::format("shot.toml:{}: render '{}' names views {}, which does not exist",
                                                   request_.line, request_.name, request_.views));
    const ViewsFile file = read_views_file(path);
    const Similarity into_calibration = calibration_from_views(file.anchors, calibration_, navspace_.radius);
    std::vector<VirtualView> views;
    for (const ExplicitView& v : file.views) {
      VirtualView view;
      view.frame = v.frame;
      view.time_s = v.time_s;
      view.pinhole = v.pinhole;
      view.cam_from_world = into_calibration * v.cam_from_world;
      if (request_.mode != "view")
        view.stereo = stereo_of(view, v.baseline ? std::optional(into_calibration.scale * *v.baseline) : std::nullopt);
      view.nav = nav_of(view.cam_from_world, v.time_s);
      view.location = locator_.locate(view.nav);
      views.push_back(std::move(view));
    }
    return views;
  }

  NavPoint nav_of(const RigidTransform& pose, double time_s) const {
    const SpherePoint p = sphere_point(navspace_, pose.centre());
    return {p.azimuth_deg, p.elevation_deg, time_s};
  }

  void add_eyes(VirtualView& view) const {
    if (!view.stereo) {
      view.eyes = {{"", view.pinhole, view.cam_from_world, view.location}};
      return;
    }
    for (const double sign : {1.0, -1.0})
      view.eyes.push_back(request_.mode == "stereo" ? displaced_eye(view, sign) : shifted_eye(view, sign));
  }

  StereoPlan stereo_of(const VirtualView& view, std::optional<double> baseline) const {
    const double centre_distance = (view.cam_from_world.centre() - navspace_.centre).norm();
    return {.rig = stereo_rig(options_, view.pinhole,
                              {.centre_distance = centre_distance,
                               .default_convergence = request_.views.empty() ? centre_distance : 0,
                               .baseline = baseline,
                               .where = request_.options.where("baseline_percent")}),
            .mapping = disparity_mapping(request_, view.pinhole.width),
            .knots = {},
            .floating_window_percent = options_.floating_window_percent};
  }

  /// Same orientation as the middle camera, so that nothing is displaced vertically. sign: +1 left, -1 right.
  VirtualEye displaced_eye(const VirtualView& view, double sign) const {
    const StereoRig& rig = view.stereo->rig;
    VirtualEye eye{eye_name(sign), rig.eye_pinhole(view.pinhole, sign), rig.eye_pose(view.cam_from_world, sign), {}};
    eye.location = locator_.locate(nav_of(eye.cam_from_world, view.time_s));
    return eye;
  }

  static VirtualEye shifted_eye(const VirtualView& view, double sign) {
    return {eye_name(sign), view.pinhole, view.cam_from_world, view.location, sign};
  }

  static std::string eye_name(double sign) { return sign > 0 ? "left" : "right"; }

  void add_knots(std::vector<VirtualView>& views) const {
    if (views.empty() || !views.front().stereo || !views.front().stereo->mapping.needs_scene()) return;
    const auto weights = knot_weights(static_cast<int>(views.size()), request_.fps);
    for (std::size_t n = 0; n < views.size(); ++n)
      for (const KnotWeight& w : weights[n])
        views[n].stereo->knots.push_back(knot_of(views[static_cast<std::size_t>(w.frame)], w.weight));
  }

  DisparityKnot knot_of(const VirtualView& view, double weight) const {
    DisparityKnot knot{weight, view.pinhole, view.cam_from_world, view.stereo->rig, {}};
    for (const int v : view.location.vertices)
      knot.images.push_back(navspace_.vertices[static_cast<std::size_t>(v)].image);
    return knot;
  }

  const RenderRequest& request_;
  const Shot& shot_;
  const Calibration& calibration_;
  const Navspace& navspace_;
  RenderOptions options_;
  NavLocator locator_;
  ViewImages images_;
  std::vector<SpherePoint> recorded_;  ///< true places of the vertices' cameras
};

}  // namespace

std::vector<VirtualView> virtual_views(const RenderRequest& request, const Shot& shot, const Calibration& calibration,
                                       const Navspace& navspace) {
  return Planner(request, shot, calibration, navspace).plan();
}

RenderNeeds render_needs(const Shot& shot, const Calibration& calibration, const Navspace& navspace) {
  const MatchedEdges edges(navspace);
  RenderNeeds needs;
  std::size_t number = 0;
  for (const RenderRequest& request : shot.renders) {
    const bool reads_depth = render_options(request).method != "correspondence" || request.mode == "stereo-depth";
    for (const VirtualView& view : virtual_views(request, shot, calibration, navspace)) {
      if (reads_depth)
        for (const int image : view.images) needs.depths.emplace(image, number);
      for (const auto& edge : edges.among(view.images)) needs.edges.emplace(edge, number);
      ++number;
    }
  }
  return needs;
}

}  // namespace vantage
