#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "jobs/reconstruct/reconstruct_group.h"
#include "jobs/reconstruct/reconstruct_job.h"
#include "jobs/vision/patch_picture.h"
#include "jobs/vision/shot_images.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

std::vector<GroupImage> load_images(JobContext& context) {
  ShotImages shot(context);
  std::vector<GroupImage> images;
  for (const auto& label : context.unit().at("images")) {
    const auto id = ImageId::parse(label.get<std::string>());
    check(id.has_value(), "the unit's images are labels");
    images.push_back({*id, shot.time_s(*id), shot.pinhole(*id), shot.cam_from_world(*id), shot.bgr(*id)});
  }
  return images;
}

ReconstructOptions options_from(const ReconstructJob::Params& params) {
  ReconstructOptions o;
  o.cell_px = params.cell_px;
  o.iterations = params.iterations;
  o.match.max_speed_widths = params.max_speed_widths;
  o.expansion.build.max_speed_widths = params.max_speed_widths;
  o.expansion.max_patches = params.max_patches;
  o.expansion.coverage = params.coverage;
  o.expansion.build.min_ncc = params.min_ncc;
  o.expansion.build.min_views = params.min_views;
  o.expansion.build.refine.optimizer = optimizer_from(params.optimizer);
  o.filter.min_views = params.min_views;
  o.filter.regularity = params.regularity;
  return o;
}

void report_figures(JobContext& context, const ReconstructReport& r) {
  context.figure("interest_points", r.num_points);
  context.figure("match_sets", r.num_match_sets);
  context.figure("lines_of_movement", r.num_lines);
  context.figure("seeds", r.num_seeds);
  context.figure("expansions_tried", r.num_tried);
  context.figure("patches", r.num_patches);
  context.figure("moving_patches", r.num_moving);
  context.figure("filtered", r.num_filtered);
  context.figure("coverage", r.coverage);
  if (r.num_patches == 0)
    context.warn(
        "no surface was found: the images of this group share too little texture, or their cameras too little of the "
        "scene");
}

void write_preview(const JobContext& context, const ViewGroup& group, const std::vector<Patch>& patches) {
  const View* middle = &group.views.front();  // of the main views the one in the middle of the list
  std::vector<const View*> mains;
  for (const View& view : group.views)
    if (view.main) mains.push_back(&view);
  if (!mains.empty()) middle = mains[mains.size() / 2];
  const auto time_s = static_cast<float>(middle->time_s + group.reference_time_s);
  write_picture(context.out("preview.jpg"), patch_preview(patches, middle->pinhole, middle->cam_from_world, time_s));
}

}  // namespace

void ReconstructJob::run(JobContext& context, const Params& params) {
  context.progress(0, "reading images");
  const ViewGroup group = make_view_group(load_images(context), params.level);
  const Reconstruction result =
      reconstruct_group(group, options_from(params),
                        [&](double fraction, const std::string& phase) { context.progress(fraction, phase); });
  report_figures(context, result.report);
  write_patches_ply(context.out("patches.ply"), result.patches);
  write_preview(context, group, result.patches);
}

}  // namespace vantage
