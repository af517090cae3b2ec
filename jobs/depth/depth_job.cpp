#include "jobs/depth/depth_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "jobs/views/depth_edges.h"
#include "jobs/views/virtual_view.h"

namespace vantage {
namespace {

/// Microseconds, so that the last bits of a clock do not make new keys.
double rounded_s(double time_s) { return std::round(time_s * 1e6) / 1e6; }

/// In the order in which renders need them; what no render needs comes last.
std::vector<int> wanted_vertices(const Shot& shot, const Calibration& calibration, const Navspace& navspace) {
  std::map<int, std::size_t> first_use = render_needs(shot, calibration, navspace).depths;
  if (shot.has_section("depth"))
    for (int v = 0; v < static_cast<int>(navspace.vertices.size()); ++v)
      first_use.emplace(v, std::numeric_limits<std::size_t>::max());
  return by_first_use(first_use);
}

class UnitWriter {
 public:
  UnitWriter(const Navspace& navspace, const DepthJob::Params& params)
      : navspace_(navspace), params_(params_to_json(params)) {}

  WorkUnit unit(int vertex, const std::vector<DepthEdge>& edges, const Pinhole& pinhole) const {
    const ImageId& image = at(vertex).image;
    std::set<std::string> needs{"calibrate", "ingest/" + image.camera};
    Json list = Json::array();
    for (const DepthEdge& edge : edges) {
      list.push_back(edge_json(vertex, edge));
      needs.insert(correspond_job_name(navspace_, vertex, edge.other));
      if (edge.step) needs.insert(correspond_job_name(navspace_, edge.other, *edge.step));
    }
    WorkUnit unit;
    unit.name = "depth/" + image.label();
    unit.params = params_;
    unit.unit = {{"image", image.label()}, {"edges", list}};
    unit.needs = {needs.begin(), needs.end()};
    unit.links = {{"depth.exr", fmt::format("depth/{}/{:06d}.exr", image.camera, image.frame)}};
    // Per pixel: two flow maps of 12 bytes at a time, and 12 bytes a hypothesis of every edge.
    const double megapixels = 1e-6 * pinhole.width * pinhole.height;
    unit.need = {.cores = 1,
                 .ram_mb = static_cast<int>(200 + megapixels * (150 + 12 * static_cast<double>(edges.size())))};
    return unit;
  }

 private:
  const NavVertex& at(int vertex) const { return navspace_.vertices[static_cast<std::size_t>(vertex)]; }

  Json link_json(int from, int to) const {
    return {{"other", at(to).image.label()}, {"job", correspond_job_name(navspace_, from, to)}, {"forward", from < to}};
  }
  Json edge_json(int vertex, const DepthEdge& edge) const {
    Json json = link_json(vertex, edge.other);
    json["lag_s"] = rounded_s(at(vertex).time_s - at(edge.other).time_s);
    if (!edge.step) return json;
    json["step"] = link_json(edge.other, *edge.step);
    json["step"]["duration_s"] = rounded_s(at(*edge.step).time_s - at(edge.other).time_s);
    return json;
  }

  const Navspace& navspace_;
  Json params_;
};

}  // namespace

std::vector<WorkUnit> DepthJob::split(const ShotState& state, const Params& params) {
  const auto calibrated = state.artifact("calibrate"), space = state.artifact("navspace");
  if (!calibrated || !space) return {};
  const Calibration calibration = read_calibration(*calibrated);
  const Navspace navspace = read_navspace(*space);
  const DepthEdges depth_edges(navspace, state.shot());
  const UnitWriter writer(navspace, params);
  std::vector<WorkUnit> units;
  for (const int vertex : wanted_vertices(state.shot(), calibration, navspace)) {
    const std::vector<DepthEdge> edges = depth_edges.of(vertex);
    if (edges.empty()) continue;
    const std::string& camera = navspace.vertices[static_cast<std::size_t>(vertex)].image.camera;
    units.push_back(writer.unit(vertex, edges, calibration.camera(camera).pinhole));
  }
  return units;
}

}  // namespace vantage
