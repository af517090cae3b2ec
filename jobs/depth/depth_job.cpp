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
  UnitWriter(const Navspace& navspace, const Calibration& calibration, const DepthJob::Params& params)
      : navspace_(navspace), calibration_(calibration), params_(params_to_json(params)) {}

  /// What an image's own edges tell.
  WorkUnit single(int vertex, const std::vector<DepthEdge>& edges) const {
    std::set<std::string> needs{"calibrate"};
    Json list = Json::array();
    for (const DepthEdge& edge : edges) {
      list.push_back(edge_json(vertex, edge));
      needs.insert(correspond_job_name(navspace_, vertex, edge.other));
      if (edge.step) needs.insert(correspond_job_name(navspace_, edge.other, *edge.step));
    }
    // Per pixel: two flow maps of 12 bytes at a time, and 8 bytes a hypothesis of every edge.
    return unit(single_name(vertex), vertex, {{"edges", list}}, needs, 60 + 8 * static_cast<double>(edges.size()));
  }

  /// That, with what the frames before and after tell, and the picture.
  WorkUnit steady(int vertex, const std::vector<int>& frames) const {
    std::set<std::string> needs{"calibrate", "ingest/" + at(vertex).image.camera, single_name(vertex)};
    Json list = Json::array();
    for (const int frame : frames) {
      list.push_back(link_json(vertex, frame));
      list.back()["single"] = single_name(frame);
      needs.insert({correspond_job_name(navspace_, vertex, frame), single_name(frame)});
    }
    const Json json{{"single", single_name(vertex)}, {"frames", list}};
    WorkUnit steady = unit("depth/" + at(vertex).image.label(), vertex, json, needs, 250);
    steady.links = {{"depth.exr", fmt::format("depth/{}/{:06d}.exr", at(vertex).image.camera, at(vertex).image.frame)}};
    return steady;
  }

 private:
  WorkUnit unit(const std::string& name, int vertex, Json json, const std::set<std::string>& needs,
                double bytes_per_px) const {
    const Pinhole& pinhole = calibration_.camera(at(vertex).image.camera).pinhole;
    WorkUnit unit;
    unit.name = name;
    unit.params = params_;
    unit.unit = std::move(json);
    unit.unit["image"] = at(vertex).image.label();
    unit.needs = {needs.begin(), needs.end()};
    unit.need = {.cores = 1, .ram_mb = static_cast<int>(200 + 1e-6 * bytes_per_px * pinhole.width * pinhole.height)};
    return unit;
  }

  const NavVertex& at(int vertex) const { return navspace_.vertices[static_cast<std::size_t>(vertex)]; }
  std::string single_name(int vertex) const { return "depth/" + at(vertex).image.label() + "/single"; }

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
  const Calibration& calibration_;
  Json params_;
};

}  // namespace

std::vector<WorkUnit> DepthJob::split(const ShotState& state, const Params& params) {
  const auto calibrated = state.artifact("calibrate"), space = state.artifact("navspace");
  if (!calibrated || !space) return {};
  const Calibration calibration = read_calibration(*calibrated);
  const Navspace navspace = read_navspace(*space);
  const DepthEdges depth_edges(navspace, state.shot());
  const UnitWriter writer(navspace, calibration, params);
  std::vector<int> vertices = wanted_vertices(state.shot(), calibration, navspace);
  std::erase_if(vertices, [&](int vertex) { return depth_edges.of(vertex).empty(); });
  const std::set<int> wanted(vertices.begin(), vertices.end());
  std::vector<WorkUnit> units;
  std::set<int> told;
  for (const int vertex : vertices) {
    std::vector<int> frames = depth_edges.frames_around(vertex, wanted), singles = frames;
    singles.push_back(vertex);
    for (const int image : singles)  // what a job needs stands before it
      if (told.insert(image).second) units.push_back(writer.single(image, depth_edges.of(image)));
    units.push_back(writer.steady(vertex, frames));
  }
  return units;
}

}  // namespace vantage
