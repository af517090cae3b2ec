#include "jobs/views/stereo_plan.h"

#include "jobs/views/camera_json.h"

namespace vantage {
namespace {

Json to_json(const StereoRig& rig) { return {rig.baseline, rig.focal_baseline, rig.inverse_convergence}; }
StereoRig rig_from(const Json& j) { return {j.at(0), j.at(1), j.at(2)}; }

Json to_json(const DisparityKnot& knot) {
  Json images = Json::array();
  for (const ImageId& image : knot.images) images.push_back({{"camera", image.camera}, {"frame", image.frame}});
  return {{"weight", knot.weight},
          {"pinhole", vantage::to_json(knot.pinhole)},
          {"pose", vantage::to_json(knot.cam_from_world)},
          {"rig", to_json(knot.rig)},
          {"images", images}};
}

DisparityKnot knot_from(const Json& j) {
  DisparityKnot knot{j.at("weight"), pinhole_from(j.at("pinhole")), pose_from(j.at("pose")), rig_from(j.at("rig")), {}};
  for (const Json& image : j.at("images")) knot.images.push_back({image.at("camera"), image.at("frame")});
  return knot;
}

}  // namespace

Json to_json(const StereoPlan& plan) {
  Json knots = Json::array();
  for (const DisparityKnot& knot : plan.knots) knots.push_back(to_json(knot));
  return {{"rig", to_json(plan.rig)},
          {"mapping", to_json(plan.mapping)},
          {"knots", knots},
          {"floating_window_percent", plan.floating_window_percent}};
}

StereoPlan stereo_plan_from(const Json& j) {
  StereoPlan plan{rig_from(j.at("rig")), disparity_mapping_from(j.at("mapping")), {}, j.at("floating_window_percent")};
  for (const Json& knot : j.at("knots")) plan.knots.push_back(knot_from(knot));
  return plan;
}

}  // namespace vantage
