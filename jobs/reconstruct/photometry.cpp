#include "jobs/reconstruct/photometry.h"

#include <Eigen/Dense>
#include <cmath>

namespace vantage {
namespace {

constexpr int kHalf = kPatchSide / 2;
using Samples = Eigen::Matrix<double, kPatchSamples, 1>;
using SampleJacobian = Eigen::Matrix<double, kPatchSamples, 6>;

/// Grey value and its slope at a pixel (centres at +0.5), bilinear. The caller keeps it one pixel inside.
struct Sample {
  double value, dx, dy;
};
Sample bilinear(const cv::Mat1f& image, double px, double py) {
  const double ax = px - 0.5, ay = py - 0.5;
  const int x = static_cast<int>(ax), y = static_cast<int>(ay);
  const double u = ax - x, v = ay - y;
  const float* row = image[y] + x;
  const float* below = image[y + 1] + x;
  const double a = row[0], b = row[1], c = below[0], d = below[1];
  return {(1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d), (1 - v) * (b - a) + v * (d - c),
          (1 - u) * (c - a) + u * (d - b)};
}

/// Takes the mean away and returns the length that is left.
double centre_samples(Samples& samples) {
  samples.array() -= samples.mean();
  return samples.norm();
}

/// Image of the patch's samples in another view: y(dx, dy) = origin + dx * along_x + dy * along_y, homogeneous.
struct PatchMotion {
  Eigen::Vector3d origin, along_x, along_y;
  Eigen::Vector3d per_inverse_depth;  ///< d y / d w
  Eigen::Matrix3d per_velocity;       ///< d y / d v, to be multiplied by the sample's inverse depth
};

PatchMotion patch_motion(const View& reference, const View& view, const TangentPlane& plane) {
  const Eigen::Matrix3d KR = view.pinhole.K() * view.cam_from_world.R;
  const Eigen::Matrix3d rotation = KR * reference.cam_from_world.R.transpose();
  PatchMotion m;
  m.per_velocity = (view.time_s - reference.time_s) * KR;
  m.per_inverse_depth = KR * (reference.centre - view.centre) + m.per_velocity * plane.velocity;
  m.origin = rotation * reference.pinhole.ray(plane.px) + plane.inverse_depth * m.per_inverse_depth;
  m.along_x = rotation.col(0) / reference.pinhole.fx + plane.slope.x() * m.per_inverse_depth;
  m.along_y = rotation.col(1) / reference.pinhole.fy + plane.slope.y() * m.per_inverse_depth;
  return m;
}

/// Whether the four corners, and so all samples, lie in front of the camera and inside the image.
bool fits(const PatchMotion& m, const View& view) {
  for (const int sy : {-kHalf, kHalf})
    for (const int sx : {-kHalf, kHalf}) {
      const Eigen::Vector3d y = m.origin + sx * m.along_x + sy * m.along_y;
      if (y.z() <= 1e-9 || !inside(view, y.hnormalized(), 1.5)) return false;
    }
  return true;
}

double sigma(double length) { return length / std::sqrt(static_cast<double>(kPatchSamples)); }

/// Derivatives of 1 - f.g for f = a / |a|, a being the centred samples: f' = (I - f f^T) a' / |a|.
void add_derivatives(Correlation& c, const Samples& f, const Samples& reference, double length, SampleJacobian& J) {
  J.rowwise() -= J.colwise().mean().eval();
  const Vector6d along = J.transpose() * f;
  c.gradient = -(J.transpose() * reference - c.ncc * along) / length;
  c.hessian = (J.transpose() * J - along * along.transpose()) / (length * length);
}

}  // namespace

Vector6d parameters(const TangentPlane& plane) {
  Vector6d p;
  p << plane.inverse_depth, plane.slope, plane.velocity;
  return p;
}

TangentPlane with_parameters(const TangentPlane& plane, const Vector6d& p) {
  return {plane.reference, plane.px, p(0), p.segment<2>(1), p.tail<3>()};
}

std::optional<TangentPlane> tangent_plane(const ViewGroup& group, int reference, const Eigen::Vector3d& point,
                                          const Eigen::Vector3d& normal, const Eigen::Vector3d& velocity) {
  const View& view = group.view(reference);
  const Eigen::Vector3d in_cam = view.cam_from_world * point;
  const Eigen::Vector3d n = view.cam_from_world.R * normal;
  const double distance = n.dot(in_cam);  // negative when the normal looks at the camera
  if (in_cam.z() <= 1e-9 || distance > -0.05 * in_cam.norm()) return std::nullopt;
  const Eigen::Vector3d m = n / distance;
  return TangentPlane{reference,
                      view.pinhole.project(in_cam),
                      1 / in_cam.z(),
                      {m.x() / view.pinhole.fx, m.y() / view.pinhole.fy},
                      velocity};
}

Eigen::Vector3d centre_at_reference_time(const ViewGroup& group, const TangentPlane& plane) {
  const View& view = group.view(plane.reference);
  return view.centre + world_ray(view, plane.px) / plane.inverse_depth;
}

Eigen::Vector3d normal_of(const ViewGroup& group, const TangentPlane& plane) {
  const View& view = group.view(plane.reference);
  const Eigen::Vector2d m(plane.slope.x() * view.pinhole.fx, plane.slope.y() * view.pinhole.fy);
  const Eigen::Vector3d ray = view.pinhole.ray(plane.px);
  const Eigen::Vector3d full(m.x(), m.y(), plane.inverse_depth - m.dot(ray.head<2>()));
  return -(view.cam_from_world.R.transpose() * full).normalized();
}

std::optional<ReferenceTexture> ReferenceTexture::sample(const ViewGroup& group, int reference,
                                                         const Eigen::Vector2d& px, double min_sigma) {
  const View& view = group.view(reference);
  if (!inside(view, px, kHalf + 1.5)) return std::nullopt;
  ReferenceTexture texture(group);
  for (int k = 0; k < kPatchSamples; ++k)
    texture.unit_(k) = bilinear(view.grey, px.x() + k % kPatchSide - kHalf, px.y() + k / kPatchSide - kHalf).value;
  const double length = centre_samples(texture.unit_);
  if (sigma(length) < min_sigma) return std::nullopt;
  texture.unit_ /= length;
  return texture;
}

std::optional<Correlation> ReferenceTexture::compare(const TangentPlane& plane, int view_index,
                                                     bool derivatives) const {
  const View& view = group_->view(view_index);
  const PatchMotion m = patch_motion(group_->view(plane.reference), view, plane);
  if (!fits(m, view)) return std::nullopt;
  Samples samples;
  SampleJacobian J;
  for (int k = 0; k < kPatchSamples; ++k) {
    const double dx = k % kPatchSide - kHalf, dy = k / kPatchSide - kHalf;
    const Eigen::Vector3d y = m.origin + dx * m.along_x + dy * m.along_y;
    const double scale = 1 / y.z(), u = y.x() * scale, v = y.y() * scale;
    const Sample s = bilinear(view.grey, u, v);
    samples(k) = s.value;
    if (!derivatives) continue;
    const Eigen::RowVector3d by_y(s.dx * scale, s.dy * scale, -(s.dx * u + s.dy * v) * scale);
    const double by_w = by_y.dot(m.per_inverse_depth);
    const double w = plane.inverse_depth + plane.slope.x() * dx + plane.slope.y() * dy;
    J.row(k) << by_w, by_w * dx, by_w * dy, w * (by_y * m.per_velocity);
  }
  const double length = centre_samples(samples);
  if (sigma(length) < 0.5) return std::nullopt;
  samples /= length;
  Correlation c;
  c.ncc = samples.dot(unit_);
  if (derivatives) add_derivatives(c, samples, unit_, length, J);
  return c;
}

}  // namespace vantage
