#pragma once
/// A depth map as a surface: a grid of triangles, torn where depth steps.
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

#include "jobs/depth/depth_points.h"

namespace vantage {

/// World units; triangles face the camera (counter-clockwise seen from it).
struct DepthMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<cv::Point> pixels;  ///< of each vertex
  std::vector<std::array<int, 3>> triangles;
};

/// max_slant_deg: triangles seen under a flatter angle than that (90: edge on) are steps of depth, and are left out.
/// min_confidence: depths below are left out.
DepthMesh mesh_of_depth(const PosedDepth& image, float min_confidence, double max_slant_deg = 86);

/// Binary little-endian PLY with vertex colours.
void write_mesh_ply(const std::filesystem::path& path, const DepthMesh& mesh, const cv::Mat3b& bgr);
/// OBJ with texture coordinates; beside it FILE.mtl and the picture as FILE.png.
void write_mesh_obj(const std::filesystem::path& path, const DepthMesh& mesh, const cv::Mat3b& bgr);

}  // namespace vantage
