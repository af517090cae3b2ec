#include "jobs/calibrate/exchange/camera_toml.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/shot/toml_section.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// One camera's table; errors name file, line and camera.
class CameraTable {
 public:
  CameraTable(const fs::path& file, const std::string& key, const toml::table& table)
      : where_(fmt::format("{}:{}: camera [{}]", file.string(), line_of(table), key)), table_(table) {}

  [[noreturn]] void fail(const std::string& what) const { throw Error(ErrorKind::BadInput, where_ + ": " + what); }

  /// All numbers of a key, rows one after another.
  std::vector<double> numbers(const char* key) const {
    std::vector<double> out;
    if (const toml::node* node = table_.get(key)) collect(*node, key, out);
    return out;
  }
  std::vector<double> numbers(const char* key, std::size_t count) const {
    std::vector<double> out = numbers(key);
    if (out.size() != count) fail(fmt::format("{} has {} numbers, expected {}", key, out.size(), count));
    return out;
  }
  bool is_set(const char* key) const { return table_[key].value_or(false); }
  std::string name(const std::string& key) const { return table_["name"].value_or(key); }

 private:
  void collect(const toml::node& node, const char* key, std::vector<double>& out) const {
    if (const auto* array = node.as_array()) {
      for (const toml::node& item : *array) collect(item, key, out);
      return;
    }
    const auto number = node.value<double>();
    if (!number || !std::isfinite(*number)) fail(fmt::format("{} holds something that is no number", key));
    out.push_back(*number);
  }
  std::string where_;
  const toml::table& table_;
};

LensModel lens_of(const CameraTable& table) {
  const auto size = table.numbers("size", 2), K = table.numbers("matrix", 9);
  std::vector<double> terms = table.numbers("distortions");
  if (table.is_set("fisheye")) table.fail("has a fisheye lens, which is not supported; expected fisheye = false");
  if (terms.size() > 8) table.fail(fmt::format("has {} distortions, at most 8 are known", terms.size()));
  if (!(size[0] >= 1 && size[1] >= 1 && K[0] > 0 && K[4] > 0)) table.fail("size and focal lengths must be above 0");
  LensModel lens{"OPENCV", static_cast<int>(size[0]), static_cast<int>(size[1]), {K[0], K[4], K[2] + 0.5, K[5] + 0.5}};
  const bool is_long = terms.size() > 4 && std::any_of(terms.begin() + 4, terms.end(), [](double k) { return k != 0; });
  if (is_long) lens.model = "FULL_OPENCV";
  terms.resize(is_long ? 8 : 4, 0.0);
  lens.params.insert(lens.params.end(), terms.begin(), terms.end());
  return lens;
}

RigidTransform pose_of(const CameraTable& table) {
  const auto turn = table.numbers("rotation"), shift = table.numbers("translation", 3);
  RigidTransform pose;
  if (turn.size() == 3) {
    const Eigen::Vector3d rodrigues(turn[0], turn[1], turn[2]);
    if (rodrigues.norm() > 0) pose.R = Eigen::AngleAxisd(rodrigues.norm(), rodrigues.normalized()).toRotationMatrix();
  } else if (turn.size() == 9) {
    pose.R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(turn.data());
    if (!(pose.R * pose.R.transpose()).isIdentity(1e-3) || pose.R.determinant() < 0)
      table.fail("rotation is no rotation matrix");
  } else {
    table.fail(fmt::format("rotation has {} numbers, expected 3 (Rodrigues) or 9", turn.size()));
  }
  pose.t = {shift[0], shift[1], shift[2]};
  return pose;
}

/// fx fy cx cy k1 k2 p1 p2 [k3 k4 k5 k6]: COLMAP's order is OpenCV's.
std::vector<double> opencv_terms(const CameraModel& camera) {
  const Pinhole& k = camera.pinhole;
  if (!camera.filmed) return {k.fx, k.fy, k.cx, k.cy, 0, 0, 0, 0};
  const auto& p = camera.filmed->params;
  const std::string& model = camera.filmed->model;
  if (model == "OPENCV" || model == "FULL_OPENCV") return p;
  if (model == "PINHOLE") return {p[0], p[1], p[2], p[3], 0, 0, 0, 0};
  return {p[0], p[0], p[1], p[2], p.size() > 3 ? p[3] : 0, p.size() > 4 ? p[4] : 0, 0, 0};
}

std::string table_of(const CameraModel& camera, const RigidTransform& pose) {
  const std::vector<double> p = opencv_terms(camera);
  const Eigen::AngleAxisd turn(pose.R);
  const Eigen::Vector3d rodrigues = turn.angle() * turn.axis();
  const int width = camera.filmed ? camera.filmed->width : camera.pinhole.width;
  const int height = camera.filmed ? camera.filmed->height : camera.pinhole.height;
  return fmt::format(
      "[{0}]\nname = \"{0}\"\nsize = [{1}.0, {2}.0]\n"
      "matrix = [[{3:#.12g}, 0.0, {4:#.12g}], [0.0, {5:#.12g}, {6:#.12g}], [0.0, 0.0, 1.0]]\n"
      "distortions = [{7:#.12g}]\nrotation = [{8:#.12g}]\ntranslation = [{9:#.12g}]\nfisheye = false\n\n",
      camera.name, width, height, p[0], p[2] - 0.5, p[1], p[3] - 0.5, fmt::join(p.begin() + 4, p.end(), ", "),
      fmt::join(rodrigues.begin(), rodrigues.end(), ", "), fmt::join(pose.t.begin(), pose.t.end(), ", "));
}

}  // namespace

Calibration read_camera_toml(const fs::path& file) {
  if (!fs::exists(file)) throw Error(ErrorKind::BadInput, fmt::format("{}: not found", file.string()));
  Calibration out;
  const toml::table root = parse_toml(file);
  for (const auto& [key, node] : root) {
    const toml::table* table = node.as_table();
    if (table == nullptr || key.str() == "metadata") continue;
    const CameraTable camera(file, std::string(key.str()), *table);
    const std::string name = camera.name(std::string(key.str()));
    const LensModel lens = lens_of(camera);
    const auto& p = lens.params;
    if (!out.cameras
             .insert({name,
                      {.name = name,
                       .id = static_cast<int>(out.cameras.size()) + 1,
                       .pinhole = {lens.width, lens.height, p[0], p[1], p[2], p[3]},
                       .filmed = lens}})
             .second)
      camera.fail(fmt::format("another camera is named '{}', too", name));
    out.cam_from_world[{name, 0}] = pose_of(camera);
  }
  if (out.cameras.empty())
    throw Error(ErrorKind::BadInput, fmt::format("{}: has no camera; expected a table per camera with size, matrix, "
                                                 "distortions, rotation and translation",
                                                 file.string()));
  return out;
}

void write_camera_toml(const fs::path& file, const Calibration& calibration) {
  std::string text;
  for (const auto& [name, camera] : calibration.cameras)
    if (const auto pose = calibration.cam_from_world.lower_bound({name, 0});
        pose != calibration.cam_from_world.end() && pose->first.camera == name)
      text += table_of(camera, pose->second);
  write_file_atomically(file, text);
}

}  // namespace vantage
