#include "jobs/correspond/correspond_job.h"

#include <algorithm>
#include <limits>

#include "jobs/mask_sources.h"
#include "jobs/views/depth_edges.h"
#include "jobs/views/matched_edges.h"
#include "jobs/views/virtual_view.h"

namespace vantage {
namespace {

using Edge = std::pair<int, int>;

/// In the order in which renders need them; what no render needs comes last.
std::vector<Edge> wanted_edges(const Shot& shot, const Calibration& calibration, const Navspace& navspace) {
  RenderNeeds needs = render_needs(shot, calibration, navspace);
  const DepthEdges depth_edges(navspace, shot);
  std::set<int> depths;
  for (const auto& [vertex, number] : needs.depths) depths.insert(vertex);
  for (const auto& [vertex, number] : needs.depths)
    for (const Edge& edge : depth_edges.needed_by(vertex, depths)) {
      std::size_t& first = needs.edges.emplace(edge, number).first->second;
      first = std::min(first, number);
    }
  if (shot.has_section("depth") || (shot.has_section("correspond") && shot.renders.empty())) {
    const MatchedEdges edges(navspace);
    for (const Edge& edge : edges.all()) needs.edges.emplace(edge, std::numeric_limits<std::size_t>::max());
  }
  return by_first_use(needs.edges);
}

/// Cost volume and path sums take 3 bytes a label and pixel, the rest about 150 bytes a pixel.
Need need_of(const Pinhole& pinhole, const CorrespondJob::Params& params) {
  const double megapixels = 1e-6 * pinhole.width * pinhole.height;
  const double mb =
      200 + 3.0 * params.max_depths * std::min(megapixels, params.max_stereo_megapixels) + 150 * megapixels;
  return {.cores = 1, .ram_mb = static_cast<int>(mb)};
}

WorkUnit unit_of(const ShotState& state, const ImageId& first, const ImageId& second, const Calibration& calibration,
                 const CorrespondJob::Params& params) {
  const std::string a = first.label(), b = second.label();
  WorkUnit unit;
  unit.name = "correspond/" + a + "__" + b;
  unit.params = params_to_json(params);
  unit.unit = {{"first", a}, {"second", b}};
  unit.needs = {"calibrate", "ingest/" + first.camera};
  if (second.camera != first.camera) unit.needs.push_back("ingest/" + second.camera);
  unit.sources = mask_sources(state, first);
  for (const Source& source : mask_sources(state, second))
    if (std::ranges::find(unit.sources, source.name, &Source::name) == unit.sources.end())
      unit.sources.push_back(source);  // one still for both frames of a camera is one source
  unit.links = {{"forward.exr", "flow/" + a + "__" + b + ".exr"}, {"backward.exr", "flow/" + b + "__" + a + ".exr"}};
  unit.need = need_of(calibration.camera(first.camera).pinhole, params);
  return unit;
}

}  // namespace

std::vector<WorkUnit> CorrespondJob::split(const ShotState& state, const Params& params) {
  const auto calibrated = state.artifact("calibrate"), space = state.artifact("navspace");
  if (!calibrated || !space) return {};
  const Calibration calibration = read_calibration(*calibrated);
  const Navspace navspace = read_navspace(*space);
  std::vector<WorkUnit> units;
  for (const auto& [a, b] : wanted_edges(state.shot(), calibration, navspace)) {
    const auto image = [&](int vertex) -> const ImageId& {
      return navspace.vertices[static_cast<std::size_t>(vertex)].image;
    };
    units.push_back(unit_of(state, image(std::min(a, b)), image(std::max(a, b)), calibration, params));
  }
  return units;
}

}  // namespace vantage
