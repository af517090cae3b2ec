#include "schema/formats/navspace.h"

#include <algorithm>
#include <map>
#include <set>

#include "schema/base/json.h"

namespace vantage {
namespace {
Json to_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d vector_of(const Json& j) { return Eigen::Vector3d(j.at(0), j.at(1), j.at(2)); }

/// An image that closes a ring is two vertices; edges become those of its first one, each once.
void name_first_vertices(Navspace& n) {
  std::map<ImageId, int> first;
  std::vector<int> first_of;
  for (std::size_t v = 0; v < n.vertices.size(); ++v)
    first_of.push_back(first.emplace(n.vertices[v].image, static_cast<int>(v)).first->second);
  if (first.size() == n.vertices.size()) return;
  std::set<std::pair<int, int>> edges;
  for (const auto& [i, k] : n.edges)
    edges.insert(std::minmax(first_of[static_cast<std::size_t>(i)], first_of[static_cast<std::size_t>(k)]));
  n.edges.assign(edges.begin(), edges.end());
}
}  // namespace

Navspace read_navspace(const std::filesystem::path& navspace_artifact) {
  const Json j = read_json(navspace_artifact / "navspace.json");
  Navspace n;
  n.centre = vector_of(j.at("centre"));
  for (int row = 0; row < 3; ++row)
    n.axes.row(row) = vector_of(j.at("axes").at(static_cast<std::size_t>(row))).transpose();
  n.radius = j.at("radius");
  for (const Json& v : j.at("vertices"))
    n.vertices.push_back({{v.at("camera"), v.at("frame")}, v.at("azimuth_deg"), v.at("elevation_deg"), v.at("time_s")});
  n.simplices = j.at("simplices").get<std::vector<std::vector<int>>>();
  for (const Json& e : j.at("edges")) n.edges.emplace_back(e.at(0), e.at(1));
  name_first_vertices(n);
  return n;
}

void write_navspace(const std::filesystem::path& file, const Navspace& n) {
  Json vertices = Json::array();
  for (const auto& v : n.vertices)
    vertices.push_back({{"camera", v.image.camera},
                        {"frame", v.image.frame},
                        {"azimuth_deg", v.azimuth_deg},
                        {"elevation_deg", v.elevation_deg},
                        {"time_s", v.time_s}});
  Json edges = Json::array();
  for (const auto& [i, k] : n.edges) edges.push_back({i, k});
  write_json(file, {{"centre", to_json(n.centre)},
                    {"axes", {to_json(n.axes.row(0)), to_json(n.axes.row(1)), to_json(n.axes.row(2))}},
                    {"radius", n.radius},
                    {"vertices", vertices},
                    {"simplices", n.simplices},
                    {"edges", edges}});
}

}  // namespace vantage
