// Navigation space: how the pictures are joined in angle and time.
#include <fmt/format.h>

#include <algorithm>

#include "scheduler/report/html.h"
#include "scheduler/report/plot.h"
#include "scheduler/report/sections.h"
#include "schema/formats/navspace.h"

namespace vantage::report {
namespace {

constexpr std::size_t kMaxEdges = 1500;  ///< drawn: more only makes the page heavy

}  // namespace

std::string navspace(const ReportInput& input) {
  const auto artifact = artifact_of(input, "navspace");
  if (artifact.empty()) return {};
  const Navspace space = read_navspace(artifact);
  if (space.vertices.empty()) return {};
  Plot::Axis x{1e300, -1e300, "azimuth (degrees)"}, y{1e300, -1e300, "time (s)"};
  for (const auto& v : space.vertices) {
    x.min = std::min(x.min, v.azimuth_deg), x.max = std::max(x.max, v.azimuth_deg);
    y.min = std::min(y.min, v.time_s), y.max = std::max(y.max, v.time_s);
  }
  Plot plot(x, y, false, 1100, 420);
  const std::size_t stride = space.edges.size() / kMaxEdges + 1;
  for (std::size_t i = 0; i < space.edges.size(); i += stride) {
    const auto &a = space.vertices[static_cast<std::size_t>(space.edges[i].first)],
               &b = space.vertices[static_cast<std::size_t>(space.edges[i].second)];
    plot.line(a.azimuth_deg, a.time_s, b.azimuth_deg, b.time_s, "#8899aa", 0.7, 0.5);
  }
  for (const auto& v : space.vertices)
    plot.dot(v.azimuth_deg, v.time_s, 3.2, colour_of(camera_index(input, v.image.camera)));
  std::string paths;
  for (const auto& render : input.shot.renders) {
    std::vector<Eigen::Vector2d> path;
    for (const auto& key : render.keyframes) path.emplace_back(key.azimuth_deg, key.time_s);
    if (path.empty()) continue;
    plot.polyline(path, "#d55e00", 2.5);
    plot.text(path.back().x(), path.back().y(), render.name, 6, -6);
    paths = " The bold line is the path of the virtual camera.";
  }
  return fmt::format(
      "<p class=\"lead\">{} images, {} simplices, {} edges; a dot is a picture, its colour the camera.{}</p>{}",
      space.vertices.size(), space.simplices.size(), space.edges.size(), paths, plot.svg());
}

}  // namespace vantage::report
