#include "jobs/views/nav_locator.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr double kVaries = 1e-6;  ///< degrees or seconds: axes with less spread do not count
constexpr double kInside = 1e-9;  ///< weights down to minus this are rounding

double median(std::vector<double> values, double fallback) {
  if (values.empty()) return fallback;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Weights with sum 1 of the point of the corners' plane that is nearest to `point`; may be negative.
Eigen::VectorXd affine_weights(const std::vector<Eigen::Vector3d>& corners, const Eigen::Vector3d& point) {
  const auto n = static_cast<Eigen::Index>(corners.size());
  Eigen::Matrix3Xd edges(3, n - 1);
  for (Eigen::Index k = 1; k < n; ++k) edges.col(k - 1) = corners[static_cast<std::size_t>(k)] - corners[0];
  Eigen::VectorXd w(n);
  w.tail(n - 1) = edges.colPivHouseholderQr().solve(point - corners[0]);
  w[0] = 1 - w.tail(n - 1).sum();
  return w;
}

Eigen::Vector3d place_of(const std::vector<Eigen::Vector3d>& corners, const std::vector<double>& weights) {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < corners.size(); ++k) p += weights[k] * corners[k];
  return p;
}

}  // namespace

std::vector<double> nearest_weights(const std::vector<Eigen::Vector3d>& corners, const Eigen::Vector3d& point) {
  if (corners.size() == 1) return {1.0};
  const Eigen::VectorXd w = affine_weights(corners, point);
  if (w.minCoeff() >= -kInside) {
    const Eigen::VectorXd inside = w.cwiseMax(0) / w.cwiseMax(0).sum();
    return {inside.begin(), inside.end()};
  }
  std::vector<double> best;
  double best_distance = std::numeric_limits<double>::infinity();
  for (std::size_t drop = 0; drop < corners.size(); ++drop) {
    if (w[static_cast<Eigen::Index>(drop)] >= 0 && corners.size() == 2) continue;
    std::vector<Eigen::Vector3d> face = corners;
    face.erase(face.begin() + static_cast<std::ptrdiff_t>(drop));
    std::vector<double> weights = nearest_weights(face, point);
    const double distance = (place_of(face, weights) - point).squaredNorm();
    if (distance >= best_distance) continue;
    best_distance = distance;
    weights.insert(weights.begin() + static_cast<std::ptrdiff_t>(drop), 0.0);
    best = std::move(weights);
  }
  return best;
}

double degrees_per_second(const Navspace& navspace) {
  std::vector<double> degrees, seconds;
  for (const auto& [i, k] : navspace.edges) {
    const NavVertex& a = navspace.vertices[static_cast<std::size_t>(i)];
    const NavVertex& b = navspace.vertices[static_cast<std::size_t>(k)];
    if (a.image.camera == b.image.camera)
      seconds.push_back(std::abs(a.time_s - b.time_s));
    else
      degrees.push_back(std::hypot(a.azimuth_deg - b.azimuth_deg, a.elevation_deg - b.elevation_deg));
  }
  if (seconds.empty())
    for (const auto& [i, k] : navspace.edges)
      seconds.push_back(std::abs(navspace.vertices[static_cast<std::size_t>(i)].time_s -
                                 navspace.vertices[static_cast<std::size_t>(k)].time_s));
  const double s = median(std::move(seconds), 0), deg = median(std::move(degrees), 0);
  return s > 0 && deg > 0 ? deg / s : 1;
}

NavLocator::NavLocator(const Navspace& navspace)
    : simplices_(navspace.simplices), deg_per_s_(degrees_per_second(navspace)) {
  check(!navspace.simplices.empty(), "a navigation space has cells");
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const NavVertex& v : navspace.vertices) {
    const Eigen::Vector3d p(v.azimuth_deg, v.elevation_deg, v.time_s);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  middle_deg_ = 0.5 * (low.x() + high.x());
  std::map<ImageId, int> vertex_of;
  for (std::size_t v = 0; v < navspace.vertices.size(); ++v)
    first_of_.push_back(vertex_of.emplace(navspace.vertices[v].image, static_cast<int>(v)).first->second);
  used_ = ((high - low).array() > kVaries).cast<double>();
  for (const NavVertex& v : navspace.vertices) places_.push_back(scaled(v.azimuth_deg, v.elevation_deg, v.time_s));
  for (std::size_t k = 0; k < simplices_.size(); ++k) {
    const Eigen::Vector3d& first = places_[static_cast<std::size_t>(simplices_[k][0])];
    Cell cell{first, first, k};
    for (const int v : simplices_[k]) {
      cell.low = cell.low.cwiseMin(places_[static_cast<std::size_t>(v)]);
      cell.high = cell.high.cwiseMax(places_[static_cast<std::size_t>(v)]);
    }
    longest_ = std::max(longest_, cell.high.z() - cell.low.z());
    cells_.push_back(cell);
  }
  std::stable_sort(cells_.begin(), cells_.end(), [](const Cell& a, const Cell& b) { return a.low.z() < b.low.z(); });
}

Eigen::Vector3d NavLocator::scaled(double azimuth_deg, double elevation_deg, double time_s) const {
  return used_.cwiseProduct(Eigen::Vector3d(azimuth_deg, elevation_deg, deg_per_s_ * time_s));
}

struct NavLocator::Best {
  NavLocation location;
  double distance = std::numeric_limits<double>::infinity();  ///< squared
};

void NavLocator::look_into(const Cell& cell, const Eigen::Vector3d& point, Best& best) const {
  const Eigen::Vector3d beyond = (cell.low - point).cwiseMax(point - cell.high).cwiseMax(0);
  if (beyond.squaredNorm() >= best.distance) return;
  const std::vector<int>& simplex = simplices_[cell.simplex];
  std::vector<Eigen::Vector3d> corners;
  for (const int v : simplex) corners.push_back(places_[static_cast<std::size_t>(v)]);
  std::vector<double> weights = nearest_weights(corners, point);
  double distance = (place_of(corners, weights) - point).squaredNorm();
  if (distance < 1e-16 * (1 + point.squaredNorm())) distance = 0;
  if (distance >= best.distance) return;
  best = {{simplex, std::move(weights), distance > 0}, distance};
}

NavLocation NavLocator::locate(const NavPoint& at) const {
  const double turns = std::round((at.azimuth_deg - middle_deg_) / 360);
  const Eigen::Vector3d point = scaled({at.azimuth_deg - 360 * turns, at.elevation_deg, at.time_s});
  const auto from = std::lower_bound(cells_.begin(), cells_.end(), point.z() - longest_,
                                     [](const Cell& cell, double time) { return cell.low.z() < time; });
  Best best;  // cells that may hold the moment and all later ones, as long as they may be nearer; then the earlier ones
  for (auto cell = from; cell != cells_.end() && best.distance > 0; ++cell) {
    const double later = std::max(0.0, cell->low.z() - point.z());
    if (later * later >= best.distance) break;
    look_into(*cell, point, best);
  }
  for (auto cell = from; cell != cells_.begin() && best.distance > 0;) {
    --cell;
    const double earlier = std::max(0.0, point.z() - cell->low.z() - longest_);
    if (earlier * earlier >= best.distance) break;
    look_into(*cell, point, best);
  }
  for (int& v : best.location.vertices) v = first_of_[static_cast<std::size_t>(v)];
  return best.location;
}

NavLocation locate(const Navspace& navspace, const NavPoint& point) { return NavLocator(navspace).locate(point); }

}  // namespace vantage
