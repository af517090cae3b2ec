#pragma once
/// What a render job is told: one output frame with everything that its pixels depend on, and nothing else.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "jobs/views/matched_edges.h"
#include "jobs/views/render_options.h"
#include "jobs/views/stereo_plan.h"
#include "jobs/views/virtual_view.h"
#include "schema/base/json.h"

namespace vantage {

struct PlannedImage {
  ImageId id;
  double time_s = 0;
};

/// An eye as it is in the next frame of the film; the last frame's stands still.
struct NextEye {
  Pinhole pinhole;
  RigidTransform cam_from_world;
  double time_s = 0;
};

struct PlannedEye {
  std::string name;  ///< "", or "left" and "right"
  Pinhole pinhole;
  RigidTransform cam_from_world;
  std::vector<double> mu;     ///< barycentric weight per image; sum 1
  std::vector<double> share;  ///< weight of an image's colours: its camera's mu, by closeness in place and time; sum 1
  std::optional<DisparityRule> disparity;  ///< mode "stereo-depth"; its curve is made where depth can be read
  std::optional<NextEye> next;             ///< empty: nobody asks for motion
};

struct FramePlan {
  double time_s = 0;
  double fps = 30;
  double scene_distance = 1;  ///< of the sphere's centre from the middle camera, world units
  std::string method = "auto";
  std::vector<PlannedImage> images;
  std::vector<std::pair<int, int>>
      edges;  ///< places in images whose maps are read; the first is the vertex with the smaller index
  std::vector<PlannedEye> eyes;
  bool outside = false;  ///< the view, or an eye of it, lies outside the recording hull
  std::optional<StereoPlan> stereo;
  bool reads_depth() const { return method == "auto" || method == "depth"; }
};

/// next: the frame after it; the last one's is itself.
FramePlan plan_frame(const VirtualView& view, const VirtualView& next, const RenderRequest& request,
                     const Calibration& calibration, const Navspace& navspace, const MatchedEdges& edges);

Json to_json(const FramePlan& plan);
FramePlan frame_plan_from(const Json& unit);

/// "correspond/cam0-000003__cam1-000004", "depth/cam0-000003"
std::string correspond_job(const ImageId& first, const ImageId& second);
std::string depth_job(const ImageId& image);
/// "render/<name>/000012"
std::string render_job(const std::string& request, int frame);

}  // namespace vantage
