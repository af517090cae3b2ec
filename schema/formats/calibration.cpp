#include "schema/formats/calibration.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <fstream>
#include <set>
#include <sstream>

#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(const fs::path& file, int line, const std::string& message) {
  throw Error(ErrorKind::BadInput, fmt::format("{}:{}: {}", file.string(), line, message));
}

const std::map<std::string, std::size_t> kLensParams{{"SIMPLE_PINHOLE", 3}, {"PINHOLE", 4}, {"SIMPLE_RADIAL", 4},
                                                     {"RADIAL", 5},         {"OPENCV", 8},  {"FULL_OPENCV", 12}};

/// Reads a text model file line by line, skipping comments; blank lines count (images.txt needs them).
class Lines {
 public:
  explicit Lines(fs::path file) : file_(std::move(file)), in_(file_) {
    if (!in_) throw Error(ErrorKind::BadInput, fmt::format("{}: not found or unreadable", file_.string()));
  }
  bool next(std::string& line) {
    while (std::getline(in_, line)) {
      ++number_;
      if (!line.empty() && line.back() == '\r') line.pop_back();
      if (line.empty() || line[0] != '#') return true;
    }
    return false;
  }
  [[noreturn]] void fail_here(const std::string& message) const { fail(file_, number_, message); }

 private:
  fs::path file_;
  std::ifstream in_;
  int number_ = 0;
};

std::map<int, LensModel> read_lenses(const fs::path& file) {
  std::map<int, LensModel> lenses;
  Lines lines(file);
  for (std::string line; lines.next(line);) {
    if (line.find_first_not_of(" \t") == std::string::npos) continue;
    std::istringstream words(line);
    int id = 0;
    LensModel lens;
    if (!(words >> id >> lens.model >> lens.width >> lens.height))
      lines.fail_here("expected: CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]");
    for (double p = 0; words >> p;) lens.params.push_back(p);
    const auto known = kLensParams.find(lens.model);
    if (known == kLensParams.end())
      lines.fail_here(fmt::format(
          "camera model {} is not supported; use PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV or FULL_OPENCV", lens.model));
    if (lens.params.size() != known->second)
      lines.fail_here(fmt::format("{} has {} parameters, expected {}", lens.model, lens.params.size(), known->second));
    if (lens.width <= 0 || lens.height <= 0 || !(lens.params[0] > 0))
      lines.fail_here("width, height and focal length must be above 0");
    lenses[id] = std::move(lens);
  }
  return lenses;
}

Pinhole pinhole_of(const LensModel& lens) {
  const auto& p = lens.params;
  const bool one_focal = lens.model == "SIMPLE_PINHOLE" || lens.model == "SIMPLE_RADIAL" || lens.model == "RADIAL";
  return one_focal ? Pinhole{lens.width, lens.height, p[0], p[0], p[1], p[2]}
                   : Pinhole{lens.width, lens.height, p[0], p[1], p[2], p[3]};
}

bool has_no_distortion(const LensModel& lens) { return lens.model == "PINHOLE" || lens.model == "SIMPLE_PINHOLE"; }

ImageId image_of_name(const std::string& name, const Lines& lines) {
  const std::size_t slash = name.rfind('/');
  const std::size_t dot = name.rfind('.');
  if (slash == std::string::npos || slash == 0)
    lines.fail_here(fmt::format("image name '{}': expected <camera>/<frame>.png", name));
  const std::string frame =
      name.substr(slash + 1, (dot == std::string::npos || dot < slash ? name.size() : dot) - slash - 1);
  const auto id = ImageId::parse(name.substr(0, slash) + "-" + frame);
  if (!id) lines.fail_here(fmt::format("image name '{}': '{}' is no frame number", name, frame));
  return *id;
}

void read_images(const fs::path& file, const std::map<int, LensModel>& lenses, Calibration& out,
                 std::map<int, ImageId>& image_ids) {
  Lines lines(file);
  std::map<int, std::string> owner;
  for (std::string line; lines.next(line);) {
    if (line.find_first_not_of(" \t") == std::string::npos) continue;
    std::istringstream words(line);
    int image_id = 0, camera_id = 0;
    double w = 0, x = 0, y = 0, z = 0;
    RigidTransform pose;
    std::string name;
    if (!(words >> image_id >> w >> x >> y >> z >> pose.t.x() >> pose.t.y() >> pose.t.z() >> camera_id >> name))
      lines.fail_here("expected: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
    if (!lenses.contains(camera_id))
      lines.fail_here(fmt::format("image '{}' names camera {}, which cameras.txt lacks", name, camera_id));
    const Eigen::Quaterniond q(w, x, y, z);
    if (!(q.norm() > 1e-6)) lines.fail_here(fmt::format("image '{}' has no rotation", name));
    pose.R = q.normalized().toRotationMatrix();
    const ImageId id = image_of_name(name, lines);
    const auto [entry, fresh] = owner.try_emplace(camera_id, id.camera);
    if (!fresh && entry->second != id.camera && out.cameras.contains(id.camera) &&
        out.cameras[id.camera].id != camera_id)
      lines.fail_here(fmt::format("camera '{}' has images with two CAMERA_IDs", id.camera));
    CameraModel& camera = out.cameras[id.camera];
    camera.name = id.camera;
    camera.id = camera_id;
    out.cam_from_world[id] = pose;
    image_ids[image_id] = id;
    std::string points;
    lines.next(points);
  }
}

void read_points(const fs::path& file, const std::map<int, ImageId>& image_ids, Calibration& out) {
  if (!fs::exists(file)) return;
  Lines lines(file);
  for (std::string line; lines.next(line);) {
    if (line.find_first_not_of(" \t") == std::string::npos) continue;
    std::istringstream words(line);
    SparsePoint p;
    std::int64_t id = 0;
    if (!(words >> id >> p.position.x() >> p.position.y() >> p.position.z() >> p.rgb.x() >> p.rgb.y() >> p.rgb.z() >>
          p.error_px))
      lines.fail_here("expected: POINT3D_ID X Y Z R G B ERROR TRACK[]");
    for (int image = 0, feature = 0; words >> image >> feature;)
      if (const auto found = image_ids.find(image); found != image_ids.end()) p.seen_in.push_back(found->second);
    out.points.push_back(std::move(p));
  }
}

std::string lens_line(int id, const LensModel& lens) {
  return fmt::format("{} {} {} {} {:.17g}\n", id, lens.model, lens.width, lens.height, fmt::join(lens.params, " "));
}

}  // namespace

const CameraModel& Calibration::camera(const std::string& name) const {
  const auto found = cameras.find(name);
  check(found != cameras.end(), "only calibrated cameras are asked for: " + name);
  return found->second;
}

const RigidTransform& Calibration::pose(const ImageId& image) const {
  const auto found = cam_from_world.find(image);
  check(found != cam_from_world.end(), "only images with a pose are asked for: " + image.label());
  return found->second;
}

Calibration read_calibration(const fs::path& folder) {
  if (!fs::is_directory(folder))
    throw Error(ErrorKind::BadInput, fmt::format("{}: no such calibration folder", folder.string()));
  Calibration out;
  const auto lenses = read_lenses(folder / "cameras.txt");
  std::map<int, ImageId> image_ids;
  read_images(folder / "images.txt", lenses, out, image_ids);
  read_points(folder / "points3D.txt", image_ids, out);
  const fs::path distorted = folder / "cameras_distorted.txt";
  const auto filmed = fs::exists(distorted) ? read_lenses(distorted) : std::map<int, LensModel>{};
  for (auto& [name, camera] : out.cameras) {
    const LensModel& lens = lenses.at(camera.id);
    camera.pinhole = pinhole_of(lens);
    if (const auto found = filmed.find(camera.id); found != filmed.end())
      camera.filmed = found->second;
    else if (!has_no_distortion(lens))
      camera.filmed = lens;
  }
  return out;
}

void write_calibration(const fs::path& folder, const Calibration& calibration) {
  std::string cameras = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n", filmed = cameras;
  bool any_filmed = false;
  for (const auto& [name, c] : calibration.cameras) {
    const auto& p = c.pinhole;
    cameras += lens_line(c.id, {"PINHOLE", p.width, p.height, {p.fx, p.fy, p.cx, p.cy}});
    if (c.filmed) filmed += lens_line(c.id, *c.filmed);
    any_filmed = any_filmed || c.filmed;
  }
  std::string images = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then an empty line of POINTS2D\n";
  std::map<ImageId, int> image_ids;
  for (const auto& [id, pose] : calibration.cam_from_world) {
    const int number = static_cast<int>(image_ids.size()) + 1;
    image_ids[id] = number;
    const Eigen::Quaterniond q(pose.R);
    images += fmt::format("{} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {} {}/{:06d}.png\n\n", number,
                          q.w(), q.x(), q.y(), q.z(), pose.t.x(), pose.t.y(), pose.t.z(),
                          calibration.camera(id.camera).id, id.camera, id.frame);
  }
  std::string points = "# POINT3D_ID X Y Z R G B ERROR TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  int point_id = 0;
  for (const auto& p : calibration.points) {
    points += fmt::format("{} {:.17g} {:.17g} {:.17g} {} {} {} {:.6g}", ++point_id, p.position.x(), p.position.y(),
                          p.position.z(), p.rgb.x(), p.rgb.y(), p.rgb.z(), p.error_px);
    for (const auto& image : p.seen_in)
      if (const auto found = image_ids.find(image); found != image_ids.end())
        points += fmt::format(" {} 0", found->second);
    points += '\n';
  }
  fs::create_directories(folder);
  write_file_atomically(folder / "cameras.txt", cameras);
  write_file_atomically(folder / "images.txt", images);
  write_file_atomically(folder / "points3D.txt", points);
  if (any_filmed) write_file_atomically(folder / "cameras_distorted.txt", filmed);
}

}  // namespace vantage
