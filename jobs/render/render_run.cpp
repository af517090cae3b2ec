#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

#include "jobs/render/composite.h"
#include "jobs/render/frame_preview.h"
#include "jobs/render/measure_disparity.h"
#include "jobs/render/render_job.h"
#include "jobs/render/render_view.h"
#include "jobs/render/scene_disparity.h"
#include "jobs/render/write_frame.h"
#include "jobs/vision/shot_images.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

std::vector<SourceImage> read_images(JobContext& context, const FramePlan& plan) {
  ShotImages shot(context);
  std::vector<SourceImage> images;
  for (const PlannedImage& planned : plan.images) {
    SourceImage image{planned.id,
                      planned.time_s,
                      shot.pinhole(planned.id),
                      shot.cam_from_world(planned.id),
                      shot.linear_bgr(planned.id),
                      {},
                      {}};
    cut_out(context, shot, image);
    if (plan.reads_depth()) image.depth = read_depth(context.input(depth_job(planned.id)) / "depth.exr");
    images.push_back(std::move(image));
  }
  return images;
}

void read_flows(JobContext& context, const FramePlan& plan, std::vector<SourceImage>& images) {
  for (const auto& [a, b] : plan.edges) {
    const auto first = static_cast<std::size_t>(a), second = static_cast<std::size_t>(b);
    const std::filesystem::path& folder = context.input(correspond_job(images[first].id, images[second].id));
    images[first].flows[b] = read_flow(folder / "forward.exr");
    images[second].flows[a] = read_flow(folder / "backward.exr");
  }
}

/// What becomes of disparity in this frame: the mean of its knots' maps.
DisparityCurve curve_of(JobContext& context, const StereoPlan& plan) {
  if (!plan.mapping.needs_scene()) return disparity_curve(plan.mapping, {});
  const ShotImages shot(context);
  std::optional<DisparityCurve> curve;
  double weight = 0;
  for (const DisparityKnot& knot : plan.knots) {
    std::vector<KnotDepth> depths;
    for (const ImageId& image : knot.images)
      depths.push_back({shot.pinhole(image), shot.cam_from_world(image),
                        read_depth(context.input(depth_job(image)) / "depth.exr").z});
    const DisparityCurve here = disparity_curve(plan.mapping, scene_disparities(knot, depths));
    weight += knot.weight;
    curve = curve ? DisparityCurve::mean(*curve, here, knot.weight / weight) : here;
  }
  check(curve.has_value(), "a frame whose map needs the scene has knots");
  return *curve;
}

/// Bars, records and figures of a pair.
void finish_pair(JobContext& context, ViewPicture& left, ViewPicture& right, const StereoPlan& plan,
                 const DisparityCurve& curve) {
  const FrameDisparity disparity = measure_disparity(left, right, plan, curve);
  draw_floating_window(left, right, plan);
  write_frame_disparity(context.out("disparity.json"), disparity);
  context.figure("disparity", to_json(disparity));
}

}  // namespace

void RenderJob::run(JobContext& context, const Params&) {
  FramePlan plan = frame_plan_from(context.unit());
  context.progress(0, "reading");
  std::vector<SourceImage> images = read_images(context, plan);
  read_flows(context, plan, images);
  const DisparityCurve curve = plan.stereo ? curve_of(context, *plan.stereo) : DisparityCurve();
  for (PlannedEye& eye : plan.eyes)
    if (eye.disparity) eye.disparity->curve = curve;
  std::vector<NamedPicture> views;
  for (const PlannedEye& eye : plan.eyes) {
    context.progress(0.2 + 0.7 * static_cast<double>(views.size()) / static_cast<double>(plan.eyes.size()), "drawing");
    views.push_back({eye.name, render_eye(images, plan, eye), {eye.pinhole, eye.cam_from_world, plan.fps}});
    if (!context.sources().contains("over")) continue;
    ViewPicture& picture = views.back().picture;
    picture = put_over(picture, read_rendered(context.source("over"), eye.name, picture.bgr.size()));
  }
  if (plan.stereo) finish_pair(context, views.at(0).picture, views.at(1).picture, *plan.stereo, curve);
  context.progress(0.9, "writing");
  write_frame_exr(context.out("frame.exr"), views);
  const cv::Mat png = frame_png(views);
  write_picture(context.out("frame.png"), png);
  write_picture(context.out("preview.jpg"), frame_preview(views.front().picture, images));
  const double known = cv::mean(views.front().picture.alpha)[0];
  context.figure("images", images.size());
  context.figure("holes_percent", 100 * (1 - known));
  if (plan.outside) context.warn("the view lies outside the recording hull: drawn from the nearest images");
}

}  // namespace vantage
