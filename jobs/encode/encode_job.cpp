#include "jobs/encode/encode_job.h"

#include <fmt/format.h>

#include "jobs/views/frame_plan.h"
#include "schema/formats/calibration.h"
#include "schema/formats/navspace.h"

namespace vantage {
namespace {

WorkUnit unit_of(const RenderRequest& request, const std::vector<int>& frames, const EncodeJob::Params& params) {
  WorkUnit unit;
  unit.name = "encode/" + request.name;
  unit.params = params_to_json(params);
  Json jobs = Json::array();
  for (const int frame : frames) {
    jobs.push_back(render_job(request.name, frame));
    unit.needs.push_back(jobs.back());
  }
  const bool stereo = request.mode != "view";
  unit.unit = {{"name", request.name}, {"fps", request.fps}, {"stereo", stereo}, {"frames", jobs}};
  const std::string out = fmt::format("render/{}/", request.name);
  unit.links = {{fmt::format("{}.mp4", request.name), fmt::format("{}{}.mp4", out, request.name)}};
  if (stereo)
    for (const char* file : {"side_by_side.mp4", "anaglyph.mp4"}) unit.links.push_back({file, out + file});
  unit.need = {.cores = 1, .ram_mb = 1000, .timeout_s = 3600};
  return unit;
}

}  // namespace

std::vector<WorkUnit> EncodeJob::split(const ShotState& state, const Params& params) {
  if (state.shot().renders.empty()) return {};
  const auto calibrate = state.artifact("calibrate"), space = state.artifact("navspace");
  if (!calibrate || !space) return {};
  const Calibration calibration = read_calibration(*calibrate);
  const Navspace navspace = read_navspace(*space);
  std::vector<WorkUnit> units;
  for (const RenderRequest& request : state.shot().renders) {
    std::vector<int> frames;
    for (const VirtualView& view : virtual_views(request, state.shot(), calibration, navspace))
      frames.push_back(view.frame);
    units.push_back(unit_of(request, frames, params));
  }
  return units;
}

}  // namespace vantage
