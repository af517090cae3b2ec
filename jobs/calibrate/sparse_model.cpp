#include "jobs/calibrate/sparse_model.h"

#include <Eigen/Geometry>
#include <fstream>
#include <sstream>

#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// Lines of a COLMAP text file without its comments.
std::vector<std::string> lines_of(const fs::path& file) {
  std::ifstream in(file);
  check(in.good(), "model_converter has written " + file.string());
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);)
    if (line.empty() || line[0] != '#') lines.push_back(line);
  return lines;
}

std::map<int, LensModel> read_lenses(const fs::path& file) {
  std::map<int, LensModel> lenses;
  for (const auto& line : lines_of(file)) {
    std::istringstream words(line);
    int id = 0;
    LensModel lens;
    check(static_cast<bool>(words >> id >> lens.model >> lens.width >> lens.height),
          "COLMAP writes whole camera lines");
    for (double p = 0; words >> p;) lens.params.push_back(p);
    lenses[id] = lens;
  }
  return lenses;
}

/// Index into `points` by COLMAP's POINT3D_ID.
std::map<long, int> read_points(const fs::path& file, SparseModel& out) {
  std::map<long, int> index;
  for (const auto& line : lines_of(file)) {
    std::istringstream words(line);
    long id = 0;
    SparseModel::Point p;
    check(static_cast<bool>(words >> id >> p.position.x() >> p.position.y() >> p.position.z() >> p.rgb.x() >>
                            p.rgb.y() >> p.rgb.z()),
          "COLMAP writes whole point lines");
    index[id] = static_cast<int>(out.points.size());
    out.points.push_back(p);
  }
  return index;
}

void read_measurements(const std::string& line, const ImageId& image, const std::map<long, int>& points,
                       SparseModel& out) {
  std::istringstream words(line);
  Eigen::Vector2d px;
  int feature = 0;
  for (long point = 0; words >> px.x() >> px.y() >> point; ++feature)
    if (point >= 0)
      out.observations.push_back({.image = image, .point = points.at(point), .px = px, .feature = feature});
}

ImageId image_of(const std::string& name) {
  const fs::path path(name);
  const auto id = ImageId::parse(path.parent_path().string() + "-" + path.stem().string());
  check(id.has_value(), "pictures are named as we named them: " + name);
  return *id;
}

}  // namespace

SparseModel read_sparse_model(const fs::path& folder) {
  SparseModel out;
  const auto lenses = read_lenses(folder / "cameras.txt");
  const auto points = read_points(folder / "points3D.txt", out);
  const auto lines = lines_of(folder / "images.txt");
  for (std::size_t i = 0; i + 1 < lines.size(); i += 2) {
    std::istringstream words(lines[i]);
    int number = 0, camera = 0;
    Eigen::Quaterniond q;
    RigidTransform pose;
    std::string name;
    check(static_cast<bool>(words >> number >> q.w() >> q.x() >> q.y() >> q.z() >> pose.t.x() >> pose.t.y() >>
                            pose.t.z() >> camera >> name),
          "COLMAP writes whole image lines");
    pose.R = q.normalized().toRotationMatrix();
    const ImageId id = image_of(name);
    out.cam_from_world[id] = pose;
    out.lenses[id.camera] = lenses.at(camera);
    read_measurements(lines[i + 1], id, points, out);
  }
  return out;
}

}  // namespace vantage
