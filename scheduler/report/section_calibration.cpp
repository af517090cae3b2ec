// Calibration: where the cameras were.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "scheduler/report/html.h"
#include "scheduler/report/plot.h"
#include "scheduler/report/sections.h"
#include "schema/formats/calibration.h"
#include "schema/formats/navspace.h"

namespace vantage::report {
namespace {

constexpr std::size_t kMaxPoints = 1500;  ///< drawn of a sparse model: more only makes the page heavy

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
template <class View>
std::pair<Plot::Axis, Plot::Axis> ranges(const Calibration& calibration,
                                         const std::map<std::string, RigidTransform>& poses, const View& view) {
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

/// As from a high stand behind the cameras: to the right, and up by how high and how far away a thing is.
class ObliqueView {
 public:
  explicit ObliqueView(const GroundView& ground) : right_(ground.right), front_(ground.front) {}
  Eigen::Vector2d operator()(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d up = front_.cross(right_);
    return {p.dot(right_) - 0.25 * p.dot(front_), p.dot(up) - 0.45 * p.dot(front_)};
  }

 private:
  Eigen::Vector3d right_, front_;
};

/// The pyramid that a camera sees, `length` long.
void draw_frustum(Plot& plot, const ObliqueView& view, const Pinhole& pinhole, const RigidTransform& pose,
                  double length, const std::string& colour) {
  const auto centre = view(pose.centre());
  std::vector<Eigen::Vector2d> rim;
  for (const auto& [u, v] :
       {std::pair(0.0, 0.0), std::pair(1.0, 0.0), std::pair(1.0, 1.0), std::pair(0.0, 1.0), std::pair(0.0, 0.0)}) {
    const Eigen::Vector3d ray = pinhole.ray({u * pinhole.width, v * pinhole.height});
    rim.push_back(view(pose.R.transpose() * (length * ray - pose.t)));
    plot.line(centre.x(), centre.y(), rim.back().x(), rim.back().y(), colour, 1.2, 0.8);
  }
  plot.polyline(rim, colour, 1.6);
}

std::string space_view(const ReportInput& input, const Calibration& calibration) {
  const auto poses = first_poses(calibration);
  if (poses.empty()) return {};
  const ObliqueView view(ground_view(input));
  const auto [x, y] = ranges(calibration, poses, view);
  Plot plot({x.min, x.max, ""}, {y.min, y.max, ""}, true);
  const std::size_t stride = calibration.points.size() / kMaxPoints + 1;
  for (std::size_t i = 0; i < calibration.points.size(); i += stride) {
    const auto& point = calibration.points[i];
    const auto p = view(point.position);
    if (plot.holds(p.x(), p.y()))
      plot.dot(p.x(), p.y(), 1.2, fmt::format("rgb({} {} {})", point.rgb.x(), point.rgb.y(), point.rgb.z()), 0.8);
  }
  const double length = 0.1 * std::max(x.max - x.min, y.max - y.min);
  for (const auto& [camera, pose] : poses) {
    const auto centre = view(pose.centre());
    draw_frustum(plot, view, calibration.camera(camera).pinhole, pose, length, colour_of(camera_index(input, camera)));
    plot.text(centre.x(), centre.y(), camera, 7, 12);
  }
  return "<div><h3>In space</h3>" + plot.svg() + "</div>";
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
  return fmt::format("<div class=\"two\">{}{}</div>{}<p class=\"lead\">{} points in space</p>{}",
                     top_view(input, model), space_view(input, model), camera_table(input, model), model.points.size(),
                     figure_list(figures_of(artifact)));
}

}  // namespace vantage::report
