#include "jobs/depth/depth_mesh.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <iterator>
#include <numbers>
#include <string>

#include "jobs/vision/shot_images.h"
#include "schema/base/files.h"

namespace vantage {
namespace {

/// Triangles of one camera's grid, in its frame.
class GridMesher {
 public:
  GridMesher(const PosedDepth& image, float min_confidence, double max_slant_deg)
      : image_(image),
        min_confidence_(min_confidence),
        min_cosine_(std::cos(max_slant_deg * std::numbers::pi / 180)),
        index_(image.depth.z.size(), -1) {}

  DepthMesh mesh() {
    for (int y = 0; y + 1 < index_.rows; ++y)
      for (int x = 0; x + 1 < index_.cols; ++x) {
        add({x, y}, {x, y + 1}, {x + 1, y});
        add({x + 1, y}, {x, y + 1}, {x + 1, y + 1});
      }
    return std::move(mesh_);
  }

 private:
  bool known(cv::Point px) const { return image_.depth.z(px) > 0 && image_.depth.confidence(px) >= min_confidence_; }
  Eigen::Vector3d in_cam(cv::Point px) const {
    return image_.pinhole.ray({px.x + 0.5, px.y + 0.5}) * static_cast<double>(image_.depth.z(px));
  }
  int vertex(cv::Point px) {
    int& index = index_(px);
    if (index < 0) {
      index = static_cast<int>(mesh_.vertices.size());
      const RigidTransform& pose = image_.cam_from_world;
      mesh_.vertices.push_back((pose.R.transpose() * (in_cam(px) - pose.t)).cast<float>());
      mesh_.pixels.push_back(px);
    }
    return index;
  }
  void add(cv::Point a, cv::Point b, cv::Point c) {
    if (!known(a) || !known(b) || !known(c)) return;
    const Eigen::Vector3d p = in_cam(a), normal = (in_cam(b) - p).cross(in_cam(c) - p).normalized();
    if (-normal.dot(p.normalized()) < min_cosine_) return;
    mesh_.triangles.push_back({vertex(a), vertex(b), vertex(c)});
  }

  const PosedDepth& image_;
  float min_confidence_;
  double min_cosine_;
  cv::Mat1i index_;  ///< of a pixel's vertex, -1 as long as it has none
  DepthMesh mesh_;
};

template <class T>
void put(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

DepthMesh mesh_of_depth(const PosedDepth& image, float min_confidence, double max_slant_deg) {
  return GridMesher(image, min_confidence, max_slant_deg).mesh();
}

void write_mesh_ply(const std::filesystem::path& path, const DepthMesh& mesh, const cv::Mat3b& bgr) {
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int "
      "vertex_indices\nend_header\n",
      mesh.vertices.size(), mesh.triangles.size());
  for (std::size_t k = 0; k < mesh.vertices.size(); ++k) {
    for (int i = 0; i < 3; ++i) put(out, mesh.vertices[k][i]);
    for (int i = 2; i >= 0; --i) put(out, bgr(mesh.pixels[k])[i]);
  }
  for (const auto& triangle : mesh.triangles) {
    put(out, static_cast<unsigned char>(3));
    for (const int corner : triangle) put(out, corner);
  }
  write_file_atomically(path, out);
}

void write_mesh_obj(const std::filesystem::path& path, const DepthMesh& mesh, const cv::Mat3b& bgr) {
  const std::string name = path.stem().string();
  const auto beside = [&](const char* suffix) { return std::filesystem::path(path).replace_extension(suffix); };
  write_picture(beside(".png"), bgr);
  write_file_atomically(beside(".mtl"), fmt::format("newmtl picture\nKd 1 1 1\nmap_Kd {}.png\n", name));
  std::string out = fmt::format("mtllib {}.mtl\nusemtl picture\n", name);
  const auto end = std::back_inserter(out);
  for (const Eigen::Vector3f& v : mesh.vertices) fmt::format_to(end, "v {:.6g} {:.6g} {:.6g}\n", v.x(), v.y(), v.z());
  for (const cv::Point& px : mesh.pixels)
    fmt::format_to(end, "vt {:.6f} {:.6f}\n", (px.x + 0.5) / bgr.cols, 1 - (px.y + 0.5) / bgr.rows);
  for (const auto& t : mesh.triangles) fmt::format_to(end, "f {0}/{0} {1}/{1} {2}/{2}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  write_file_atomically(path, out);
}

}  // namespace vantage
