#pragma once
#include <Eigen/Core>
#include <compare>
#include <optional>
#include <string>
#include <vector>

namespace vantage {

/// One picture of the shot. frame: 0-based index in the footage, in order of presentation (video) or file name
/// (stills).
struct ImageId {
  std::string camera;
  int frame = 0;
  auto operator<=>(const ImageId&) const = default;
  /// "cam0-000003", as in file and job names.
  std::string label() const;
  /// Inverse of label(); empty when the text is no label.
  static std::optional<ImageId> parse(const std::string& label);
};

/// Pinhole camera without distortion. Pixel centres at +0.5; x right, y down.
struct Pinhole {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  Eigen::Matrix3d K() const;
  /// Pixel of a point in the camera's frame (x right, y down, z forward); z must not be 0.
  Eigen::Vector2d project(const Eigen::Vector3d& point_in_cam) const {
    return {fx * point_in_cam.x() / point_in_cam.z() + cx, fy * point_in_cam.y() / point_in_cam.z() + cy};
  }
  /// Direction with z = 1 of the ray through a pixel, in the camera's frame.
  Eigen::Vector3d ray(const Eigen::Vector2d& px) const { return {(px.x() - cx) / fx, (px.y() - cy) / fy, 1.0}; }
};

/// A pose: point_in_cam = R * point_in_world + t.
struct RigidTransform {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return R * point + t; }
  /// Camera centre in the world.
  Eigen::Vector3d centre() const { return -R.transpose() * t; }
};

/// A lens as filmed, in COLMAP's words: model is SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV or FULL_OPENCV,
/// params in COLMAP's order.
struct LensModel {
  std::string model;
  int width = 0, height = 0;
  std::vector<double> params;
};

/// One physical camera: the pinhole of its undistorted images and, where these differ from the footage's pixels, the
/// lens.
struct CameraModel {
  std::string name;
  int id = 0;  ///< COLMAP's CAMERA_ID
  Pinhole pinhole;
  std::optional<LensModel> filmed;  ///< empty: footage pixels are undistorted pixels
};

}  // namespace vantage
