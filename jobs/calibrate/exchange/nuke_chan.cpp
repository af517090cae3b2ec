#include "jobs/calibrate/exchange/nuke_chan.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>

#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Half a turn about x: our axes to Nuke's and back, for worlds and cameras alike.
Eigen::Matrix3d half_turn() { return Eigen::Vector3d(1, -1, -1).asDiagonal(); }

Eigen::Matrix3d rotation_of(const Eigen::Vector3d& degrees) {
  const Eigen::Vector3d angle = degrees * kDegree;
  return (Eigen::AngleAxisd(angle.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(angle.x(), Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(angle.z(), Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

/// Angles about x, y and z, degrees; |x| <= 90. Looking straight up or down, where y and z cannot be told apart, z is
/// 0.
Eigen::Vector3d angles_of(const Eigen::Matrix3d& R) {
  const double sin_x = std::clamp(-R(1, 2), -1.0, 1.0);
  Eigen::Vector3d angle(std::asin(sin_x), 0, 0);
  if (std::abs(sin_x) < 1 - 1e-12) {
    angle.y() = std::atan2(R(0, 2), R(2, 2));
    angle.z() = std::atan2(R(1, 0), R(1, 1));
  } else {
    angle.y() = std::atan2(-R(2, 0), R(0, 0));
  }
  return angle / kDegree;
}

}  // namespace

ChanCamera read_chan(const fs::path& file) {
  std::ifstream in(file);
  if (!in) throw Error(ErrorKind::BadInput, fmt::format("{}: not found or unreadable", file.string()));
  ChanCamera out;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    const auto fail = [&](const std::string& what) {
      throw Error(ErrorKind::BadInput, fmt::format("{}:{}: {}", file.string(), number, what));
    };
    std::istringstream words(line);
    double frame = 0, vfov_deg = 0;
    Eigen::Vector3d place, degrees;
    if (!(words >> frame >> place.x() >> place.y() >> place.z() >> degrees.x() >> degrees.y() >> degrees.z() >>
          vfov_deg))
      fail("expected: frame tx ty tz rx ry rz vfov");
    if (!(vfov_deg > 0 && vfov_deg < 180))
      fail(fmt::format("the angle of view is {} degrees, expected 0 to 180", vfov_deg));
    if (frame < 0 || frame != std::floor(frame)) fail(fmt::format("frame {} is no whole number from 0 on", frame));
    if (out.cam_from_world.empty()) out.vfov_deg = vfov_deg;
    if (std::abs(vfov_deg - out.vfov_deg) > 0.01)
      fail(fmt::format("the angle of view changes from {} to {} degrees; cameras that zoom are not supported",
                       out.vfov_deg, vfov_deg));
    RigidTransform& pose = out.cam_from_world[static_cast<int>(frame)];
    pose.R = half_turn() * rotation_of(degrees).transpose() * half_turn();
    pose.t = -pose.R * (half_turn() * place);
  }
  if (out.cam_from_world.empty()) throw Error(ErrorKind::BadInput, fmt::format("{}: has no frame", file.string()));
  return out;
}

void write_chan(const fs::path& file, const Pinhole& pinhole, const std::map<int, RigidTransform>& cam_from_world) {
  const double vfov_deg = 2 * std::atan(pinhole.height / (2 * pinhole.fy)) / kDegree;
  std::string text;
  for (const auto& [frame, pose] : cam_from_world) {
    const Eigen::Vector3d place = half_turn() * pose.centre();
    const Eigen::Vector3d degrees = angles_of(half_turn() * pose.R.transpose() * half_turn());
    text += fmt::format("{}\t{:.9g}\t{:.9g}\t{:.9g}\t{:.9g}\t{:.9g}\t{:.9g}\t{:.9g}\n", frame, place.x(), place.y(),
                        place.z(), degrees.x(), degrees.y(), degrees.z(), vfov_deg);
  }
  write_file_atomically(file, text);
}

Pinhole pinhole_of_vfov(double vfov_deg, int width, int height) {
  const double f = height / (2 * std::tan(vfov_deg * kDegree / 2));
  return {width, height, f, f, width / 2.0, height / 2.0};
}

}  // namespace vantage
