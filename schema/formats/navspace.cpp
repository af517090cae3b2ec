#include "schema/formats/navspace.h"

#include "schema/base/json.h"

namespace vantage {
namespace {
Json to_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d vector_of(const Json& j) { return Eigen::Vector3d(j.at(0), j.at(1), j.at(2)); }
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
