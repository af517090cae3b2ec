#include <optional>
#include <string>
#include <vector>

#include "jobs/depth/depth_job.h"
#include "jobs/depth/depth_preview.h"
#include "jobs/depth/fuse_depth.h"
#include "jobs/depth/regularise.h"
#include "jobs/depth/steady_depth.h"
#include "jobs/depth/triangulate_edge.h"
#include "jobs/vision/shot_images.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// Frames of one camera see a surface alike: they agree closer than edges between cameras do.
constexpr double kSteadyShare = 1.0 / 3;

ImageId image_of(const Json& json, const char* key) {
  const auto image = ImageId::parse(json.at(key).get<std::string>());
  check(image.has_value(), "the unit of a depth job names images");
  return *image;
}

FlowMap flow_of(const JobContext& context, const Json& link) {
  const bool forward = link.at("forward").get<bool>();
  return read_flow(context.input(link.at("job").get<std::string>()) / (forward ? "forward.exr" : "backward.exr"));
}

EdgeDepth depth_of_edge(const JobContext& context, const ShotImages& images, const ImageId& image, const Json& edge,
                        const DepthJob::Params& params) {
  const ImageId other = image_of(edge, "other");
  std::optional<StepFlow> step;
  if (edge.contains("step")) step = {flow_of(context, edge.at("step")), edge.at("step").at("duration_s").get<double>()};
  const TwoView views(images.pinhole(image), images.cam_from_world(image), images.pinhole(other),
                      images.cam_from_world(other));
  return triangulate_edge(views, images.pinhole(other).fx, flow_of(context, edge), edge.at("lag_s").get<double>(), step,
                          {.max_epipolar_px = params.max_epipolar_px, .min_angle_deg = params.min_angle_deg});
}

double known_percent(const cv::Mat& known) {
  return 100.0 * cv::countNonZero(known) / static_cast<double>(known.total());
}

void run_single(JobContext& context, const DepthJob::Params& params) {
  const ImageId image = image_of(context.unit(), "image");
  const ShotImages images(context);
  const Json& edges = context.unit().at("edges");
  std::vector<EdgeDepth> depths;
  for (const Json& edge : edges) {
    context.progress(static_cast<double>(depths.size()) / static_cast<double>(edges.size()), "triangulating");
    depths.push_back(depth_of_edge(context, images, image, edge, params));
  }
  write_depth(context.out("single.exr"), fuse_depths(depths, params.agreement_percent / 100));
}

DepthMap read_single(const JobContext& context, const Json& holder) {
  return read_depth(context.input(holder.at("single").get<std::string>()) / "single.exr");
}

void run_steady(JobContext& context, const DepthJob::Params& params) {
  const Json& unit = context.unit();
  const ImageId image = image_of(unit, "image");
  ShotImages images(context);
  std::vector<DepthMap> carried;
  for (const Json& frame : unit.at("frames")) {
    context.progress(0.2 * static_cast<double>(carried.size()), "frames around");
    const DepthFrame other{read_single(context, frame), images.cam_from_world(image_of(frame, "other")),
                           flow_of(context, frame)};
    carried.push_back(carried_depth(other, images.pinhole(image), images.cam_from_world(image)));
  }
  context.progress(0.5, "outlines and gaps");
  const double agreement = params.agreement_percent / 100;
  const cv::Mat bgr = images.bgr(image);
  const DepthMap own = read_single(context, unit);
  const DepthMap depth = regularise(steady_depth(own, carried, kSteadyShare * agreement), bgr,
                                    {.agreement = agreement, .max_gap_percent = params.max_gap_percent});

  context.progress(0.9, "writing");
  write_depth(context.out("depth.exr"), depth);
  write_picture(context.out("preview.jpg"), depth_preview(bgr, depth, own.confidence));
  const double known = known_percent(depth.z > 0);
  context.figure("frames", carried.size() + 1);
  context.figure("known_percent", known);
  context.figure("agreed_percent", known_percent(depth.confidence > kLoneConfidence));
  if (known < 10)
    context.warn("depth is known on " + std::to_string(static_cast<int>(known)) + " % of " + image.label() +
                 " only: its edges hardly match");
}

}  // namespace

void DepthJob::run(JobContext& context, const Params& params) {
  if (context.unit().contains("edges"))
    run_single(context, params);
  else
    run_steady(context, params);
}

}  // namespace vantage
