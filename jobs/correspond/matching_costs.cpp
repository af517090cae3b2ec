#include "jobs/correspond/matching_costs.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "jobs/correspond/census.h"
#include "jobs/vision/vector_clones.h"

namespace vantage {
namespace {

/// Cost of a hypothesis that leads out of picture b: worse than a match (about 10 bits differ), better than chance
/// (31).
constexpr std::uint8_t kOutsideCost = 20;
/// Distances of the planes of one orientation grow by this factor: shear differs by a fifth between them.
constexpr double kDistanceRatio = 1.25;
/// Rays this close to a plane's own direction do not see it: sine.
constexpr float kGrazing = 0.05F;

/// Inverse depths below this share of the largest are as good as none: the planes end there.
constexpr double kFarthestShare = 0.02;
/// Distance between the cameras over that of the scene from where on slanted patches pay: at 0.2 a floor's census
/// window shears by more than a pixel.
constexpr double kNearlyAlike = 0.2;
constexpr double kTilt_rad = 70 * CV_PI / 180;

/// Where the line  n + w e  of one pixel goes, as element indices of picture b.
struct LineBuffers {
  std::vector<std::int32_t> x, y;
};

VANTAGE_VECTOR_CLONES void trace_line(const float* n, const float* e, float first, float step, int count,
                                      std::int32_t* xs, std::int32_t* ys) {
  for (int k = 0; k < count; ++k) {
    const float w = first + step * static_cast<float>(k);
    const float z = n[2] + w * e[2];
    // Behind b, or so far off that an int cannot hold it: element -1 is outside.
    const float scale = z > 1e-6F ? 1 / z : 0;
    const float px = std::min(std::max((n[0] + w * e[0]) * scale, -1.0F), 1e6F);
    const float py = std::min(std::max((n[1] + w * e[1]) * scale, -1.0F), 1e6F);
    xs[k] = z > 1e-6F ? static_cast<std::int32_t>(px + 1) - 1 : -1;
    ys[k] = static_cast<std::int32_t>(py + 1) - 1;
  }
}

/// Lowers costs to those of this line; out of the picture they stay.
VANTAGE_VECTOR_CLONES void lower_costs(std::uint64_t centre, const Census& b, const std::int32_t* xs,
                                       const std::int32_t* ys, int count, std::uint8_t* costs) {
  for (int k = 0; k < count; ++k) {
    const bool inside = static_cast<unsigned>(xs[k]) < static_cast<unsigned>(b.width) &&
                        static_cast<unsigned>(ys[k]) < static_cast<unsigned>(b.height);
    const int bits = inside ? std::popcount(centre ^ b.row(ys[k])[xs[k]]) : kCensusBits;
    costs[k] = static_cast<std::uint8_t>(std::min<int>(bits, costs[k]));
  }
}

VANTAGE_VECTOR_CLONES void cost_line(std::uint64_t centre, const Census& b, const std::int32_t* xs,
                                     const std::int32_t* ys, int count, std::uint8_t* costs) {
  for (int k = 0; k < count; ++k) {
    const bool inside = static_cast<unsigned>(xs[k]) < static_cast<unsigned>(b.width) &&
                        static_cast<unsigned>(ys[k]) < static_cast<unsigned>(b.height);
    costs[k] = inside ? static_cast<std::uint8_t>(std::popcount(centre ^ b.row(ys[k])[xs[k]])) : kOutsideCost;
  }
}

void upright_costs(const Census& a, const Census& b, const TwoView& views, const Sweep& sweep, CostVolume& volume) {
  LineBuffers line{std::vector<std::int32_t>(static_cast<std::size_t>(sweep.count)),
                   std::vector<std::int32_t>(static_cast<std::size_t>(sweep.count))};
  const Eigen::Vector3f ef = views.e.cast<float>();
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      const Eigen::Vector3f n = views.homogeneous({x + 0.5, y + 0.5}, 0).cast<float>();
      trace_line(n.data(), ef.data(), static_cast<float>(sweep.first), static_cast<float>(sweep.step), sweep.count,
                 line.x.data(), line.y.data());
      cost_line(a.row(y)[x], b, line.x.data(), line.y.data(), sweep.count, volume.at(x, y));
    }
}

/// Planes  normal . X = distance  in a's frame.
struct Orientation {
  Eigen::Vector3d normal;
  std::vector<double> distances;  ///< falling: inverse depths rise
};

/// b as it looks through one plane from a.
struct Aspect {
  Census census;
  Eigen::Matrix3f a_from_b;
};

Aspect seen_through(const PosedPicture& a, const cv::Mat1b& grey_b, const TwoView& views, const Eigen::Vector3d& normal,
                    double distance) {
  const Eigen::RowVector3d per_pixel = normal.transpose() * a.pinhole.K().inverse() / distance;
  const Eigen::Matrix3d b_from_a = views.H + views.e * per_pixel;
  // OpenCV counts pixels from their centres.
  Eigen::Matrix3d half = Eigen::Matrix3d::Identity();
  half(0, 2) = half(1, 2) = 0.5;
  const Eigen::Matrix3d warp = half.inverse() * b_from_a * half;
  cv::Mat1d matrix(3, 3);
  for (int k = 0; k < 9; ++k) matrix(k / 3, k % 3) = warp(k / 3, k % 3);
  cv::Mat1b seen;
  cv::warpPerspective(grey_b, seen, matrix, a.grey.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                      cv::BORDER_REPLICATE);
  return {census_transform(seen), b_from_a.inverse().cast<float>()};
}

/// Smallest and largest of normal . ray over the picture where the plane is seen.
std::pair<double, double> range_of_rays(const Pinhole& pinhole, const Eigen::Vector3d& normal) {
  double least = 1e9, most = 0;
  for (int gy = 0; gy <= 8; ++gy)
    for (int gx = 0; gx <= 8; ++gx) {
      const double s = normal.dot(pinhole.ray({pinhole.width * gx / 8.0, pinhole.height * gy / 8.0}));
      if (s < kGrazing) continue;
      least = std::min(least, s);
      most = std::max(most, s);
    }
  return {least, most};
}

/// Distances of planes that cover all inverse depths at all pixels.
std::vector<double> distances_of(const Pinhole& pinhole, const Eigen::Vector3d& normal, const Sweep& sweep) {
  const auto [least, most] = range_of_rays(pinhole, normal);
  std::vector<double> distances;
  const double nearest = least / sweep.last(), farthest = most / std::max(sweep.first, kFarthestShare * sweep.last());
  for (double d = farthest * kDistanceRatio; d > nearest / kDistanceRatio; d /= kDistanceRatio) distances.push_back(d);
  return distances;
}

/// Planes that turn about the baseline, as far as floor and ceiling do before a camera held level: for these the patch
/// shears. None where the views differ so little that an upright patch fits.
std::vector<Orientation> orientations(const PosedPicture& a, const PosedPicture& b, const Sweep& sweep) {
  const Eigen::Vector3d baseline = a.cam_from_world * b.cam_from_world.centre();
  if (baseline.norm() * (sweep.first + sweep.last()) / 2 < kNearlyAlike) return {};
  const Eigen::Vector3d along = baseline.normalized();
  Eigen::Vector3d ahead =
      Eigen::Vector3d::UnitZ() + a.cam_from_world.R * b.cam_from_world.R.transpose() * Eigen::Vector3d::UnitZ();
  ahead = (ahead - ahead.dot(along) * along).normalized();
  const Eigen::Vector3d up = along.cross(ahead);
  std::vector<Orientation> all;
  for (const double side : {1.0, -1.0}) {
    const Eigen::Vector3d normal = std::cos(kTilt_rad) * ahead + side * std::sin(kTilt_rad) * up;
    all.push_back({normal, distances_of(a.pinhole, normal, sweep)});
  }
  return all;
}

/// Linear in the pixel's column: value of a row's first pixel, and change per pixel.
struct AlongRow {
  Eigen::Vector3f start, step;
  AlongRow(const Eigen::Matrix3f& of_pixel, int y)
      : start(of_pixel * Eigen::Vector3f(0.5F, static_cast<float>(y) + 0.5F, 1)), step(of_pixel.col(0)) {}
  Eigen::Vector3f at(int x) const { return start + static_cast<float>(x) * step; }
};

/// Labels whose inverse depth lies nearer to this plane than to its neighbours of the same orientation.
struct LabelRange {
  float slope_from, slope_to, offset;
  LabelRange(double distance, const Sweep& sweep)
      : slope_from(static_cast<float>(1 / (distance * std::sqrt(kDistanceRatio) * sweep.step))),
        slope_to(static_cast<float>(std::sqrt(kDistanceRatio) / (distance * sweep.step))),
        offset(static_cast<float>(sweep.first / sweep.step)) {}
  int from(float along_normal) const { return std::max(0, static_cast<int>(along_normal * slope_from - offset + 1)); }
  int to(float along_normal, int count) const {
    return std::clamp(static_cast<int>(along_normal * slope_to - offset + 1), 0, count);
  }
};

void slanted_costs(const PosedPicture& a, const Census& census_a, const cv::Mat1b& grey_b, const TwoView& views,
                   const Orientation& orientation, const Sweep& sweep, CostVolume& volume) {
  LineBuffers line{std::vector<std::int32_t>(static_cast<std::size_t>(sweep.count)),
                   std::vector<std::int32_t>(static_cast<std::size_t>(sweep.count))};
  const Eigen::Vector3f along = (orientation.normal.transpose() * a.pinhole.K().inverse()).transpose().cast<float>();
  for (const double distance : orientation.distances) {
    const Aspect aspect = seen_through(a, grey_b, views, orientation.normal, distance);
    const Eigen::Matrix3f at_infinity = aspect.a_from_b * views.H.cast<float>();
    const Eigen::Vector3f parallax = aspect.a_from_b * views.e.cast<float>();
    const LabelRange range(distance, sweep);
    for (int y = 0; y < census_a.height; ++y) {
      const AlongRow ends(at_infinity, y);
      const float along_start = along.dot(Eigen::Vector3f(0.5F, static_cast<float>(y) + 0.5F, 1));
      for (int x = 0; x < census_a.width; ++x) {
        const float along_normal = along_start + static_cast<float>(x) * along.x();
        if (along_normal < kGrazing) continue;
        const int from = range.from(along_normal), count = range.to(along_normal, sweep.count) - from;
        if (count <= 0) continue;
        const Eigen::Vector3f n = ends.at(x);
        trace_line(n.data(), parallax.data(), static_cast<float>(sweep.first + from * sweep.step),
                   static_cast<float>(sweep.step), count, line.x.data(), line.y.data());
        lower_costs(census_a.row(y)[x], aspect.census, line.x.data(), line.y.data(), count, volume.at(x, y) + from);
      }
    }
  }
}

}  // namespace

CostVolume matching_costs(const PosedPicture& a, const PosedPicture& b, const Sweep& sweep) {
  const TwoView views = two_views(a, b);
  const Census census_a = census_transform(a.grey), census_b = census_transform(b.grey);
  CostVolume volume(a.grey.size(), sweep.count);
  upright_costs(census_a, census_b, views, sweep, volume);
  for (const Orientation& o : orientations(a, b, sweep)) slanted_costs(a, census_a, b.grey, views, o, sweep, volume);
  return volume;
}

}  // namespace vantage
