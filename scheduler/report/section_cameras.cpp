// Calibration, clocks and navigation space: where the cameras were, when, and how their pictures are joined.
#include <fmt/format.h>

#include <algorithm>

#include "scheduler/report/html.h"
#include "scheduler/report/plot.h"
#include "scheduler/report/sections.h"
#include "schema/formats/calibration.h"
#include "schema/formats/clocks.h"
#include "schema/formats/navspace.h"

namespace vantage::report {
namespace {

constexpr std::size_t kMaxPoints = 1500;  ///< drawn of a sparse model or of the edges: more only makes the page heavy

std::size_t camera_index(const ReportInput& input, const std::string& name) {
  for (std::size_t i = 0; i < input.shot.cameras.size(); ++i)
    if (input.shot.cameras[i].name == name) return i;
  return input.shot.cameras.size();
}

struct GroundView {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX(), front = Eigen::Vector3d::UnitZ();
  Eigen::Vector2d operator()(const Eigen::Vector3d& p) const { return {p.dot(right), -p.dot(front)}; }
};

/// The ground as the navigation space sees it; the world's x and z as long as there is none.
GroundView ground_view(const ReportInput& input) {
  const auto artifact = artifact_of(input, "navspace");
  if (artifact.empty()) return {};
  const Navspace space = read_navspace(artifact);
  return {space.axes.row(0).transpose(), space.axes.row(2).transpose()};
}

/// One pose a camera stands for: the first.
std::map<std::string, RigidTransform> first_poses(const Calibration& calibration) {
  std::map<std::string, RigidTransform> poses;
  for (const auto& [image, pose] : calibration.cam_from_world) poses.emplace(image.camera, pose);
  return poses;
}

/// Range of the middle 96 % of the points and of all camera centres: stray points do not shrink the picture.
std::pair<Plot::Axis, Plot::Axis> ranges(const Calibration& calibration,
                                         const std::map<std::string, RigidTransform>& poses, const GroundView& view) {
  std::vector<double> xs, ys;
  for (const auto& point : calibration.points) {
    xs.push_back(view(point.position).x());
    ys.push_back(view(point.position).y());
  }
  Plot::Axis x{1e300, -1e300, "to the right (world units)"}, y{1e300, -1e300, "away from the cameras"};
  const auto middle = [](std::vector<double>& values, Plot::Axis& axis) {
    if (values.empty()) return;
    std::sort(values.begin(), values.end());
    axis.min = values[values.size() / 50];
    axis.max = values[values.size() - 1 - values.size() / 50];
  };
  middle(xs, x);
  middle(ys, y);
  for (const auto& [camera, pose] : poses) {
    const auto c = view(pose.centre());
    x.min = std::min(x.min, c.x()), x.max = std::max(x.max, c.x());
    y.min = std::min(y.min, c.y()), y.max = std::max(y.max, c.y());
  }
  return {x, y};
}

std::string top_view(const ReportInput& input, const Calibration& calibration) {
  const auto poses = first_poses(calibration);
  if (poses.empty()) return {};
  const GroundView view = ground_view(input);
  const auto [x, y] = ranges(calibration, poses, view);
  Plot plot(x, y, true);
  const std::size_t stride = calibration.points.size() / kMaxPoints + 1;
  for (std::size_t i = 0; i < calibration.points.size(); i += stride) {
    const auto& point = calibration.points[i];
    const auto p = view(point.position);
    const std::string colour = fmt::format("rgb({} {} {})", point.rgb.x(), point.rgb.y(), point.rgb.z());
    if (plot.holds(p.x(), p.y())) plot.dot(p.x(), p.y(), 1.2, colour, 0.8);
  }
  const double arrow = 0.12 * std::max(x.max - x.min, y.max - y.min);
  for (const auto& [camera, pose] : poses) {
    const auto centre = view(pose.centre());
    const Eigen::Vector2d tip = centre + arrow * view(pose.R.row(2).transpose());
    const std::string colour = colour_of(camera_index(input, camera));
    plot.line(centre.x(), centre.y(), tip.x(), tip.y(), colour, 2, 0.8);
    plot.dot(centre.x(), centre.y(), 4.5, colour);
    plot.text(centre.x(), centre.y(), camera, 7, 12);
  }
  return "<div><h3>From above</h3>" + plot.svg() + "</div>";
}

std::string camera_table(const ReportInput& input, const Calibration& calibration) {
  std::vector<std::vector<std::string>> rows{{"camera", "image", "focal length", "lens", "images with a pose"}};
  for (const auto& camera : input.shot.cameras) {
    const auto found = calibration.cameras.find(camera.name);
    if (found == calibration.cameras.end()) {
      rows.push_back({html::escape(camera.name), "<span class=\"bad\">not calibrated</span>", "", "", "0"});
      continue;
    }
    const Pinhole& p = found->second.pinhole;
    const auto num_poses = std::count_if(calibration.cam_from_world.begin(), calibration.cam_from_world.end(),
                                         [&](const auto& entry) { return entry.first.camera == camera.name; });
    rows.push_back({html::escape(camera.name), fmt::format("{} × {}", p.width, p.height),
                    fmt::format("{:.1f} px", p.fx),
                    found->second.filmed ? html::escape(found->second.filmed->model) : "no distortion",
                    std::to_string(num_poses)});
  }
  return html::table(rows);
}

std::string figure_list(const Json& figures) {
  std::string items;
  for (const auto& [name, value] : figures.items())
    if (name != "warnings" && (value.is_primitive() || value.size() <= 6))
      items += fmt::format("{}<b>{}</b> {}", items.empty() ? "" : " · ", html::escape(name), html::figure(value));
  return items.empty() ? items : "<p class=\"lead\">" + items + "</p>";
}

}  // namespace

std::string calibration(const ReportInput& input) {
  const auto artifact = artifact_of(input, "calibrate");
  if (artifact.empty()) return {};
  const Calibration model = read_calibration(artifact);
  return fmt::format("<div class=\"two\">{}<div>{}<p class=\"lead\">{} points in space</p>{}</div></div>",
                     top_view(input, model), camera_table(input, model), model.points.size(),
                     figure_list(figures_of(artifact)));
}

std::string clocks(const ReportInput& input) {
  const auto artifact = artifact_of(input, "align");
  if (artifact.empty()) return {};
  const Clocks clocks = read_clocks(artifact);
  std::vector<std::vector<std::string>> rows{{"camera", "starts at", "±", "rate"}};
  for (const auto& camera : input.shot.cameras) {
    const CameraClock* clock = clocks.find(camera.name);
    const std::string name = html::escape(camera.name) + (camera.name == clocks.reference ? " (reference)" : "");
    if (clock == nullptr)
      rows.push_back({name, "<span class=\"bad\">could not be tied to the others</span>", "", ""});
    else
      rows.push_back({name, fmt::format("{:+.4f} s", clock->offset_s),
                      fmt::format("{:.1f} ms", 1000 * clock->offset_std_s), fmt::format("{:.6f}", clock->rate)});
  }
  std::vector<std::vector<std::string>> pairs{{"pair", "offset", "±", "method", "verdict"}};
  for (const ReportJob* job : finished(input, "sync")) {
    const PairOffset pair = read_pair_offset(job->artifact);
    pairs.push_back(
        {html::escape(pair.a + " – " + pair.b),
         pair.determined ? fmt::format("{:+.4f} s", pair.offset_s) : "<span class=\"warn\">undetermined</span>",
         fmt::format("{:.1f} ms", 1000 * pair.std_s), html::escape(pair.method), html::escape(pair.verdict)});
  }
  return html::table(rows) + (pairs.size() > 1 ? "<h3>Pairs</h3>" + html::table(pairs) : "");
}

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
  const std::size_t stride = space.edges.size() / kMaxPoints + 1;
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
