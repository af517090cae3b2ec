#include "jobs/encode/encode_job.h"

#include <fmt/format.h>

#include <map>

#include "jobs/views/frame_plan.h"
#include "schema/formats/calibration.h"
#include "schema/formats/navspace.h"

namespace vantage {
namespace {

/// x264 keeps about sixty pictures of the film in its look-ahead and references.
int ram_mb(const Pinhole& eye, const EncodeJob::Params& params) {
  const double bytes = 2.0 * eye.width * eye.height * (params.bits > 8 || params.prores ? 6 : 3);
  return 300 + static_cast<int>(60 * bytes / 1e6);
}

/// What people find beside the frames. A render may be named as one of the layouts is: then that name is its own.
std::vector<OutLink> links_of(const std::string& name, bool stereo, const EncodeJob::Params& params) {
  const std::string film = name + ".mp4";
  std::map<std::string, std::string> file_of{{film, film}};
  if (params.prores) file_of[name + ".mov"] = name + ".mov";
  if (stereo) {
    for (const std::string& layout : params.stereo)
      file_of.emplace(layout + ".mp4", layout == kFilmLayout ? film : layout + ".mp4");
    for (const char* record : {"depth_budget.json", "depth_budget.png"}) file_of[record] = record;
  }
  std::vector<OutLink> links;
  for (const auto& [to, from] : file_of) links.push_back({from, fmt::format("render/{}/{}", name, to)});
  return links;
}

WorkUnit unit_of(const RenderRequest& request, const std::vector<VirtualView>& views, const EncodeJob::Params& params) {
  WorkUnit unit;
  unit.name = "encode/" + request.name;
  unit.params = params_to_json(params);
  Json jobs = Json::array(), frames = Json::array();
  for (const VirtualView& view : views) {
    frames.push_back(view.frame);
    jobs.push_back(render_job(request.name, view.frame));
    unit.needs.push_back(jobs.back());
  }
  const RenderOptions options = render_options(request);
  const bool stereo = request.mode != "view";
  unit.unit = {{"name", request.name},
               {"fps", request.fps},
               {"stereo", stereo},
               {"jobs", jobs},
               {"frames", frames},
               {"see_through", options.is_see_through()},
               {"crossed_percent", options.crossed_percent},
               {"uncrossed_percent", options.uncrossed_percent}};
  unit.links = links_of(request.name, stereo, params);
  const int ram = views.empty() ? 1000 : ram_mb(views.front().pinhole, params);
  unit.need = {.cores = 1, .ram_mb = ram, .timeout_s = 3600 + 2 * static_cast<int>(views.size())};
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
  for (const RenderRequest& request : state.shot().renders)
    units.push_back(unit_of(request, virtual_views(request, state.shot(), calibration, navspace), params));
  return units;
}

}  // namespace vantage
