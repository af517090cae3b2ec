#include "jobs/views/frame_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "jobs/views/camera_json.h"

namespace vantage {
namespace {

Json to_json(const PlannedEye& eye) {
  Json j = {{"name", eye.name},
            {"pinhole", to_json(eye.pinhole)},
            {"pose", to_json(eye.cam_from_world)},
            {"mu", eye.mu},
            {"share", eye.share}};
  if (eye.next)
    j["next"] = {{"pinhole", to_json(eye.next->pinhole)},
                 {"pose", to_json(eye.next->cam_from_world)},
                 {"time_s", eye.next->time_s}};
  if (eye.disparity) j["shift_sign"] = eye.disparity->sign;
  return j;
}

PlannedEye eye_from(const Json& j, const std::optional<StereoPlan>& stereo) {
  PlannedEye eye{j.at("name"),
                 pinhole_from(j.at("pinhole")),
                 pose_from(j.at("pose")),
                 j.at("mu"),
                 j.at("share"),
                 std::nullopt,
                 {}};
  if (j.contains("next")) {
    const Json& next = j.at("next");
    eye.next = NextEye{pinhole_from(next.at("pinhole")), pose_from(next.at("pose")), next.at("time_s")};
  }
  if (j.contains("shift_sign")) eye.disparity = DisparityRule{j.at("shift_sign"), stereo.value().rig, {}};
  return eye;
}

/// How much each image of one camera counts at time_s: the two around it linearly, beyond them nothing; the nearest
/// when all lie on one side. Sum 1.
std::vector<double> closeness(const std::vector<double>& times_s, double time_s) {
  std::vector<double> weights(times_s.size(), 0);
  int before = -1, after = -1;
  for (int k = 0; k < static_cast<int>(times_s.size()); ++k) {
    const double t = times_s[static_cast<std::size_t>(k)];
    if (t <= time_s && (before < 0 || t > times_s[static_cast<std::size_t>(before)])) before = k;
    if (t > time_s && (after < 0 || t < times_s[static_cast<std::size_t>(after)])) after = k;
  }
  if (before < 0 || after < 0) {
    weights[static_cast<std::size_t>(std::max(before, after))] = 1;
    return weights;
  }
  const double t0 = times_s[static_cast<std::size_t>(before)], t1 = times_s[static_cast<std::size_t>(after)];
  weights[static_cast<std::size_t>(after)] = (time_s - t0) / (t1 - t0);
  weights[static_cast<std::size_t>(before)] = 1 - weights[static_cast<std::size_t>(after)];
  return weights;
}

/// Images of cameras outside the cell count this much: enough to fill what the others do not see, too little to be
/// seen.
constexpr double kFillShare = 1e-3;

/// How much a camera's direction counts beside its mu: cells may be slivers with a far corner, and far cameras see
/// other things. 1 at the nearest camera's distance or less, falling with the square beyond twice that.
double nearness(double distance, double nearest) {
  const double beyond = distance / (2 * nearest + 1e-9);
  return 1 / (1 + beyond * beyond);
}

/// distances: of the images' cameras from the eye.
std::vector<double> shares(const std::vector<PlannedImage>& images, const std::vector<double>& mu,
                           const std::vector<double>& distances, double time_s) {
  const double nearest = *std::min_element(distances.begin(), distances.end());
  std::map<std::string, std::vector<std::size_t>> by_camera;
  for (std::size_t k = 0; k < images.size(); ++k) by_camera[images[k].id.camera].push_back(k);
  std::vector<double> share(images.size());
  double sum = 0;
  for (const auto& [camera, members] : by_camera) {
    double camera_mu = 0;
    std::vector<double> times_s;
    for (const std::size_t k : members) {
      camera_mu += mu[k];
      times_s.push_back(images[k].time_s);
    }
    const std::vector<double> close = closeness(times_s, time_s);
    for (std::size_t m = 0; m < members.size(); ++m) {
      const double near = nearness(distances[members[m]], nearest);
      share[members[m]] = near * std::max(camera_mu, kFillShare) * std::max(close[m], kFillShare);
      sum += share[members[m]];
    }
  }
  for (double& s : share) s /= sum;
  return share;
}

/// Maps between frames of one camera carry motion; maps to images of the cell carry the interpolation itself.
bool reads_edge(const FramePlan& plan, std::size_t a, std::size_t b) {
  if (plan.method == "correspondence" || plan.images[a].id.camera == plan.images[b].id.camera) return true;
  if (plan.method == "depth") return false;
  if (plan.method == "plain")
    return std::any_of(plan.eyes.begin(), plan.eyes.end(),
                       [&](const PlannedEye& eye) { return eye.mu[a] > 0 && eye.mu[b] > 0; });
  return std::any_of(plan.eyes.begin(), plan.eyes.end(),
                     [&](const PlannedEye& eye) { return eye.mu[a] > 0 || eye.mu[b] > 0; });
}

}  // namespace

std::string correspond_job(const ImageId& first, const ImageId& second) {
  return fmt::format("correspond/{}__{}", first.label(), second.label());
}
std::string depth_job(const ImageId& image) { return "depth/" + image.label(); }
std::string render_job(const std::string& request, int frame) {
  return fmt::format("render/{}/{:06d}", request, frame);
}

FramePlan plan_frame(const VirtualView& view, const VirtualView& next, const RenderRequest& request,
                     const Calibration& calibration, const Navspace& navspace, const MatchedEdges& edges) {
  FramePlan plan;
  plan.time_s = view.time_s;
  plan.fps = request.fps;
  plan.scene_distance = (view.cam_from_world * navspace.centre).norm();
  plan.method = request.mode == "stereo-depth" ? "depth" : render_options(request).method;
  plan.outside = view.location.outside || std::any_of(view.eyes.begin(), view.eyes.end(),
                                                      [](const VirtualEye& eye) { return eye.location.outside; });
  if (request.mode != "view") plan.stereo = view.stereo;
  std::map<int, std::size_t> place;
  for (const int v : view.images) {
    place[v] = plan.images.size();
    const NavVertex& vertex = navspace.vertices[static_cast<std::size_t>(v)];
    plan.images.push_back({vertex.image, vertex.time_s});
  }
  for (std::size_t e = 0; e < view.eyes.size(); ++e) {
    const VirtualEye &eye = view.eyes[e], &then = next.eyes.at(e);
    PlannedEye planned{eye.name,
                       eye.pinhole,
                       eye.cam_from_world,
                       std::vector<double>(plan.images.size(), 0.0),
                       {},
                       std::nullopt,
                       NextEye{then.pinhole, then.cam_from_world, next.time_s}};
    if (eye.shift_sign != 0) planned.disparity = DisparityRule{eye.shift_sign, view.stereo->rig, {}};
    for (std::size_t k = 0; k < eye.location.vertices.size(); ++k)
      planned.mu[place.at(eye.location.vertices[k])] = eye.location.weights[k];
    std::vector<double> distances;
    for (const PlannedImage& image : plan.images)
      distances.push_back((calibration.pose(image.id).centre() - eye.cam_from_world.centre()).norm());
    planned.share = shares(plan.images, planned.mu, distances, plan.time_s);
    plan.eyes.push_back(std::move(planned));
  }
  for (const auto& [i, k] : edges.among(view.images))
    if (reads_edge(plan, place[i], place[k]))
      plan.edges.emplace_back(static_cast<int>(place[i]), static_cast<int>(place[k]));
  return plan;
}

Json to_json(const FramePlan& plan) {
  Json images = Json::array(), eyes = Json::array();
  for (const PlannedImage& image : plan.images)
    images.push_back({{"camera", image.id.camera}, {"frame", image.id.frame}, {"time_s", image.time_s}});
  for (const PlannedEye& eye : plan.eyes) eyes.push_back(to_json(eye));
  Json unit = {{"time_s", plan.time_s}, {"fps", plan.fps},        {"scene_distance", plan.scene_distance},
               {"method", plan.method}, {"images", images},       {"edges", plan.edges},
               {"eyes", eyes},          {"outside", plan.outside}};
  if (plan.stereo) unit["stereo"] = to_json(*plan.stereo);
  return unit;
}

FramePlan frame_plan_from(const Json& unit) {
  FramePlan plan;
  plan.time_s = unit.at("time_s");
  plan.fps = unit.at("fps");
  plan.scene_distance = unit.at("scene_distance");
  plan.method = unit.at("method");
  plan.edges = unit.at("edges");
  plan.outside = unit.at("outside");
  for (const Json& image : unit.at("images"))
    plan.images.push_back({{image.at("camera"), image.at("frame")}, image.at("time_s")});
  if (unit.contains("stereo")) plan.stereo = stereo_plan_from(unit.at("stereo"));
  for (const Json& eye : unit.at("eyes")) plan.eyes.push_back(eye_from(eye, plan.stereo));
  return plan;
}

}  // namespace vantage
