#include "jobs/render/render_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "jobs/mask_sources.h"
#include "jobs/views/frame_plan.h"
#include "jobs/views/hex_colour.h"
#include "jobs/views/hull_limits.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// Twelve images of 640 x 360 take 260 MB in all (measured): about 45 bytes a pixel of an image and 25 a pixel of its
/// layer; the eyes are drawn one after the other.
int ram_mb(const FramePlan& plan, const Calibration& calibration) {
  double bytes = 0;
  for (const PlannedImage& image : plan.images) {
    const Pinhole& p = calibration.camera(image.id.camera).pinhole;
    bytes += 60.0 * p.width * p.height;
  }
  const Pinhole& view = plan.eyes.front().pinhole;
  bytes += 40.0 * static_cast<double>(plan.images.size()) * view.width * view.height;
  return 200 + static_cast<int>(bytes / 1e6);
}

std::set<std::string> depths_read(const FramePlan& plan) {
  std::set<std::string> jobs;
  if (plan.reads_depth())
    for (const PlannedImage& image : plan.images) jobs.insert(depth_job(image.id));
  if (plan.stereo)
    for (const DisparityKnot& knot : plan.stereo->knots)
      for (const ImageId& image : knot.images) jobs.insert(depth_job(image));
  return jobs;
}

/// What compositing needs besides the plan.
void add_composite(WorkUnit& unit, const FramePlan& plan, const RenderRequest& request, int frame,
                   const ShotState& state) {
  const RenderOptions options = render_options(request);
  if (options.matte == "none") return;
  Json keys = Json::object();
  std::set<std::string> named;
  for (const PlannedImage& image : plan.images) {
    if (options.matte == "key") keys[image.id.camera] = state.shot().camera(image.id.camera).key_color;
    if (options.matte != "mask") continue;
    for (Source& source : mask_sources(state, image.id))
      if (named.insert(source.name).second) unit.sources.push_back(std::move(source));
  }
  unit.unit["matte"] = {{"kind", options.matte}, {"keys", keys}};
  if (options.over.empty()) return;
  const std::filesystem::path over = state.shot().folder / options.over / fmt::format("frame.{:06d}.exr", frame);
  if (!std::filesystem::is_regular_file(over))
    throw Error(ErrorKind::BadInput, fmt::format("{}: names {}, which has no frame.{:06d}.exr; expected one for each "
                                                 "frame of render '{}': render the set along the same path first",
                                                 request.options.where("over"), options.over, frame, request.name));
  unit.sources.push_back({"over", std::filesystem::canonical(over)});
}

/// Mattes are there to be made.
void check_composite(const RenderRequest& request, const Shot& shot) {
  const RenderOptions options = render_options(request);
  if (options.matte == "none" && !options.over.empty())
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: needs matte = \"key\" or \"mask\": without one nothing of what is "
                            "behind would be seen",
                            request.options.where("over")));
  for (const ShotCamera& camera : shot.cameras) {
    const std::string where = fmt::format("{}:{}: camera '{}'", request.options.file, camera.line, camera.name);
    if (options.matte == "key") rgb_from_hex(camera.key_color, where + " key_color");
    if (options.matte == "mask" && camera.mask.empty())
      throw Error(ErrorKind::BadInput,
                  fmt::format("{}: has no mask, render '{}' with matte = \"mask\" needs one of every "
                              "camera",
                              where, request.name));
  }
}

WorkUnit unit_of(const RenderRequest& request, const VirtualView& view, const VirtualView& next,
                 const Calibration& calibration, const Navspace& navspace, const MatchedEdges& edges,
                 const ShotState& state) {
  const FramePlan plan = plan_frame(view, next, request, calibration, navspace, edges);
  WorkUnit unit;
  unit.name = render_job(request.name, view.frame);
  unit.unit = to_json(plan);
  add_composite(unit, plan, request, view.frame, state);
  std::set<std::string> cameras;
  for (const PlannedImage& image : plan.images) cameras.insert(image.id.camera);
  unit.needs.emplace_back("calibrate");
  for (const std::string& camera : cameras) unit.needs.push_back("ingest/" + camera);
  for (const auto& [a, b] : plan.edges)
    unit.needs.push_back(
        correspond_job(plan.images[static_cast<std::size_t>(a)].id, plan.images[static_cast<std::size_t>(b)].id));
  for (const std::string& depth : depths_read(plan)) unit.needs.push_back(depth);
  const std::string out = fmt::format("render/{}/frame.{:06d}", request.name, view.frame);
  unit.links = {{"frame.exr", out + ".exr"}, {"frame.png", out + ".png"}};
  unit.need = {.cores = 1, .ram_mb = ram_mb(plan, calibration), .timeout_s = 3600};
  return unit;
}

}  // namespace

void RenderJob::check(const Shot& shot) {
  for (const RenderRequest& request : shot.renders) {
    check_composite(request, shot);
    if (request.views.empty()) continue;
    const std::filesystem::path path = shot.folder / request.views;
    if (!std::filesystem::is_regular_file(path))
      throw Error(ErrorKind::BadInput, fmt::format("{}:{}: render '{}' names views {}, which does not exist",
                                                   request.options.file, request.line, request.name, request.views));
    if (read_views_file(path).views.empty())
      throw Error(ErrorKind::BadInput, fmt::format("{}: has no views, needs one or more", path.string()));
  }
}

std::vector<WorkUnit> RenderJob::split(const ShotState& state, const Params&) {
  if (state.shot().renders.empty()) return {};
  const auto calibrate = state.artifact("calibrate"), space = state.artifact("navspace");
  if (!calibrate || !space) return {};
  const Calibration calibration = read_calibration(*calibrate);
  const Navspace navspace = read_navspace(*space);
  const MatchedEdges edges(navspace);
  std::vector<WorkUnit> units;
  for (const RenderRequest& request : state.shot().renders) {
    const bool refuse = render_options(request).outside == "refuse";
    const std::vector<VirtualView> views = virtual_views(request, state.shot(), calibration, navspace);
    for (std::size_t k = 0; k < views.size(); ++k) {
      if (refuse) refuse_outside(request, views[k], navspace);
      units.push_back(
          unit_of(request, views[k], views[std::min(k + 1, views.size() - 1)], calibration, navspace, edges, state));
    }
  }
  return units;
}

}  // namespace vantage
