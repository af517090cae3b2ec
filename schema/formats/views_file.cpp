#include "schema/formats/views_file.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <set>

#include "schema/base/error.h"
#include "schema/base/json.h"

namespace vantage {
namespace {

Eigen::Matrix3d matrix_of(const Json& rows) {
  Eigen::Matrix3d m;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      m(r, c) = rows.at(static_cast<std::size_t>(r)).at(static_cast<std::size_t>(c)).get<double>();
  return m;
}

RigidTransform pose_of(const Json& j) {
  RigidTransform pose;
  pose.R = matrix_of(j.at("R"));
  for (int i = 0; i < 3; ++i) pose.t[i] = j.at("t").at(static_cast<std::size_t>(i)).get<double>();
  if ((pose.R * pose.R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > 1e-3 ||
      pose.R.determinant() < 0)
    throw Error(ErrorKind::BadInput, "R is not a rotation");
  return pose;
}

ExplicitView view_of(const Json& j) {
  ExplicitView v;
  v.frame = j.at("frame");
  v.time_s = j.at("time_s");
  const Eigen::Matrix3d K = matrix_of(j.at("K"));
  v.pinhole = {j.at("width"), j.at("height"), K(0, 0), K(1, 1), K(0, 2), K(1, 2)};
  if (v.pinhole.width <= 0 || v.pinhole.height <= 0 || !(K(0, 0) > 0) || !(K(1, 1) > 0))
    throw Error(ErrorKind::BadInput, "width, height and focal lengths must be above 0");
  v.cam_from_world = pose_of(j);
  if (j.contains("baseline")) v.baseline = j.at("baseline").get<double>();
  return v;
}

}  // namespace

ViewsFile read_views_file(const std::filesystem::path& path) {
  const Json j = read_json(path);
  ViewsFile file;
  std::string where = "the file";
  try {
    if (j.value("version", 1) != 1)
      throw Error(ErrorKind::BadInput, fmt::format("version {} is unknown, expected 1", j.at("version").dump()));
    std::set<int> frames;
    for (const Json& v : j.at("views")) {
      where = fmt::format("view {}", file.views.size());
      file.views.push_back(view_of(v));
      if (!frames.insert(file.views.back().frame).second)
        throw Error(ErrorKind::BadInput, fmt::format("frame {} is there twice", file.views.back().frame));
    }
    for (const Json& a : j.value("anchors", Json::array())) {
      where = fmt::format("anchor {}", file.anchors.size());
      file.anchors.push_back({{a.at("camera"), a.at("frame")}, pose_of(a)});
    }
  } catch (const std::exception& e) {
    throw Error(ErrorKind::BadInput, fmt::format("{}: {}: {}", path.string(), where, e.what()));
  }
  return file;
}

}  // namespace vantage
