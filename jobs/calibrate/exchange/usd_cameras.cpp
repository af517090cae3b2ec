#include "jobs/calibrate/exchange/usd_cameras.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cctype>

#include "schema/base/files.h"

namespace vantage {
namespace {

constexpr double kSensorWidthMm = 36;

/// A name that USD takes: letters, digits and '_', no digit first.
std::string prim_name(const std::string& name) {
  std::string out = std::isdigit(static_cast<unsigned char>(name[0])) != 0 ? "_" + name : name;
  for (char& c : out)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  return out;
}

/// Our world and cameras (y down, looking along +z) to USD's (y up, looking along -z), written for row vectors.
std::string matrix_text(const RigidTransform& pose) {
  const Eigen::Matrix3d half_turn = Eigen::Vector3d(1, -1, -1).asDiagonal();
  const Eigen::Array33d axes = (half_turn * pose.R.transpose() * half_turn).array() + 0.0;  // no -0
  const Eigen::Array3d centre = (half_turn * pose.centre()).array() + 0.0;
  std::string rows;
  for (int i = 0; i < 3; ++i) rows += fmt::format("({:.9g}, {:.9g}, {:.9g}, 0), ", axes(0, i), axes(1, i), axes(2, i));
  return fmt::format("( {}({:.9g}, {:.9g}, {:.9g}, 1) )", rows, centre.x(), centre.y(), centre.z());
}

std::string camera_text(const Calibration& calibration, const CameraModel& camera) {
  const Pinhole& k = camera.pinhole;
  const double mm_per_px = kSensorWidthMm / k.width;
  std::string text = fmt::format(
      "    def Camera \"{}\"\n    {{\n        float focalLength = {:.9g}\n        float horizontalAperture = {:.9g}\n"
      "        float verticalAperture = {:.9g}\n        float horizontalApertureOffset = {:.9g}\n"
      "        float verticalApertureOffset = {:.9g}\n        float2 clippingRange = (0.001, 100000)\n"
      "        matrix4d xformOp:transform.timeSamples = {{\n",
      prim_name(camera.name), k.fx * mm_per_px, kSensorWidthMm, k.height * mm_per_px * k.fx / k.fy,
      (k.width / 2.0 - k.cx) * mm_per_px, (k.cy - k.height / 2.0) * mm_per_px * k.fx / k.fy);
  for (auto image = calibration.cam_from_world.lower_bound({camera.name, 0});
       image != calibration.cam_from_world.end() && image->first.camera == camera.name; ++image)
    text += fmt::format("            {}: {},\n", image->first.frame, matrix_text(image->second));
  return text + "        }\n        uniform token[] xformOpOrder = [\"xformOp:transform\"]\n    }\n";
}

std::string points_text(const std::vector<SparsePoint>& points) {
  std::string places, colours;
  for (const SparsePoint& p : points) {
    places += fmt::format("({:.6g}, {:.6g}, {:.6g}), ", p.position.x(), -p.position.y(), -p.position.z());
    const Eigen::Vector3d linear = (p.rgb.cast<double>() / 255).array().pow(2.2);
    colours += fmt::format("({:.4g}, {:.4g}, {:.4g}), ", linear.x(), linear.y(), linear.z());
  }
  return fmt::format(
      "    def Points \"points\"\n    {{\n        point3f[] points = [{}]\n"
      "        color3f[] primvars:displayColor = [{}] (\n            interpolation = \"vertex\"\n        )\n    }}\n",
      places, colours);
}

}  // namespace

void write_usd_cameras(const std::filesystem::path& file, const Calibration& calibration, double metres_per_unit) {
  int last_frame = 0;
  for (const auto& [image, pose] : calibration.cam_from_world) last_frame = std::max(last_frame, image.frame);
  std::string text = "#usda 1.0\n(\n    defaultPrim = \"shot\"\n    upAxis = \"Y\"\n";
  if (metres_per_unit > 0) text += fmt::format("    metersPerUnit = {:.9g}\n", metres_per_unit);
  text += fmt::format("    startTimeCode = 0\n    endTimeCode = {}\n)\n\ndef Xform \"shot\"\n{{\n", last_frame);
  for (const auto& [name, camera] : calibration.cameras) text += camera_text(calibration, camera);
  if (!calibration.points.empty()) text += points_text(calibration.points);
  write_file_atomically(file, text + "}\n");
}

}  // namespace vantage
