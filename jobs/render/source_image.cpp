#include "jobs/render/source_image.h"

#include <cmath>

namespace vantage {

Eigen::Vector3d world_of(const SourceImage& image, const Eigen::Vector2d& px, double z) {
  return image.cam_from_world.R.transpose() * (z * image.pinhole.ray(px) - image.cam_from_world.t);
}

double sample_depth(const cv::Mat1f& z, const Eigen::Vector2d& px) {
  const double x = px.x() - 0.5, y = px.y() - 0.5;
  if (!(x >= 0 && y >= 0 && x <= z.cols - 1 && y <= z.rows - 1)) return 0;
  const int x0 = std::min(static_cast<int>(x), z.cols - 2), y0 = std::min(static_cast<int>(y), z.rows - 2);
  if (x0 < 0 || y0 < 0) return 0;
  const double a = x - x0, b = y - y0;
  const double z00 = z(y0, x0), z10 = z(y0, x0 + 1), z01 = z(y0 + 1, x0), z11 = z(y0 + 1, x0 + 1);
  if (z00 <= 0 || z10 <= 0 || z01 <= 0 || z11 <= 0) return 0;
  return (1 - b) * ((1 - a) * z00 + a * z10) + b * ((1 - a) * z01 + a * z11);
}

}  // namespace vantage
