#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "jobs/fuse/fuse_job.h"
#include "jobs/fuse/fuse_patches.h"
#include "jobs/fuse/patch_spacing.h"
#include "jobs/fuse/surface.h"
#include "jobs/groups/image_groups.h"
#include "jobs/vision/patch_picture.h"
#include "jobs/vision/shot_images.h"

namespace vantage {
namespace {

std::vector<std::vector<Patch>> read_groups(const JobContext& context) {
  std::vector<std::vector<Patch>> groups;
  const auto count = context.unit().at("groups").get<std::size_t>();
  for (std::size_t g = 0; g < count; ++g)
    groups.push_back(read_patches_ply(context.input(group_job_name(g)) / "patches.ply"));
  return groups;
}

/// Middle of every group's time, each once, rising.
std::vector<float> group_times(const std::vector<std::vector<Patch>>& groups) {
  std::set<float> times;
  for (const auto& group : groups)
    if (!group.empty()) times.insert((group.front().t0_s + group.front().t1_s) / 2);
  return {times.begin(), times.end()};
}

std::vector<Patch> valid_at(const std::vector<Patch>& patches, float time_s) {
  std::vector<Patch> out;
  for (const Patch& p : patches)
    if (p.t0_s <= time_s && time_s <= p.t1_s) out.push_back(p);
  return out;
}

std::string points_name(float time_s) {
  return fmt::format("points_{}.ply", std::lround(1000 * static_cast<double>(time_s)));
}

void write_surface(JobContext& context, const FuseJob::Params& params, const std::vector<Patch>& patches, float time_s,
                   const PatchSpacing& spacing) {
  const auto points = context.scratch() / "surface_points.ply";
  write_points_ply(points, patches, time_s);
  const auto out = context.out("surface.ply");
  const int vertices = write_poisson_surface(points, out, context.scratch(),
                                             {.depth = params.surface_depth, .trim = params.surface_trim});
  context.figure("surface_vertices", vertices);
  if (vertices > 0) return;
  context.warn(fmt::format("{} patches at {:.3f} s make no closed surface; surface.ply holds the patches as squares",
                           patches.size(), static_cast<double>(time_s)));
  write_patch_squares(out, patches, time_s, spacing);
}

/// From the camera in the middle of the list, which is as good as any.
void write_preview(const JobContext& context, const Calibration& calibration, const std::vector<Patch>& patches,
                   float time_s) {
  std::vector<std::pair<const CameraModel*, const RigidTransform*>> posed;
  for (const auto& [name, camera] : calibration.cameras)
    if (const auto pose = calibration.cam_from_world.lower_bound({name, 0});
        pose != calibration.cam_from_world.end() && pose->first.camera == name)
      posed.emplace_back(&camera, &pose->second);
  if (posed.empty()) return;
  const auto& [camera, pose] = posed[posed.size() / 2];
  write_picture(context.out("preview.jpg"), patch_preview(patches, camera->pinhole, *pose, time_s));
}

}  // namespace

void FuseJob::run(JobContext& context, const Params& params) {
  context.progress(0, "reading patches");
  const std::vector<std::vector<Patch>> groups = read_groups(context);
  const Calibration calibration = read_calibration(context.input("calibrate"));
  const PatchSpacing spacing = measure_spacing(groups, PixelFootprint(calibration));
  context.progress(0.1, "merging groups");
  FuseReport report;
  const std::vector<Patch> model =
      fuse_patches(groups, spacing, {.merge_distance = params.merge_distance, .kappa = params.kappa}, report);
  context.figure("patches", model.size());
  context.figure("static_patches", report.num_static);
  context.figure("moving_patches", report.num_moving);
  context.figure("merged", report.num_merged);
  context.figure("unsupported", report.num_unsupported);
  write_patches_ply(context.out("patches.ply"), model);

  context.progress(0.4, "points");
  const std::vector<float> times = group_times(groups);
  for (const float time_s : times)
    write_points_ply(context.out("points/" + points_name(time_s)), valid_at(model, time_s), time_s);
  const float middle_s = times.empty() ? 0 : times[times.size() / 2];
  if (times.empty()) {
    context.warn("no group gave any patch: the model is empty");
    write_points_ply(context.out("points/" + points_name(middle_s)), {}, middle_s);
  }
  context.progress(0.5, "surface");
  const std::vector<Patch> now = valid_at(model, middle_s);
  write_surface(context, params, now, middle_s, spacing);
  write_preview(context, calibration, now, middle_s);
}

}  // namespace vantage
