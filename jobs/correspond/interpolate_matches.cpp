#include "jobs/correspond/interpolate_matches.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "jobs/correspond/geodesic_cells.h"

namespace vantage {
namespace {

/// motion = M (1, x - centre, y - centre).
using Affine = Eigen::Matrix<float, 2, 3>;

struct Sample {
  Eigen::Vector3f place;  ///< (1, x - centre, y - centre)
  Eigen::Vector2f motion;
  float weight;
};
using Samples = std::vector<Sample>;

float robust(float squared_px, float inlier_px) { return 1 / (1 + squared_px / (inlier_px * inlier_px)); }

float weighted_median(const Samples& samples, int axis) {
  std::vector<std::pair<float, float>> values;
  float total = 0;
  for (const Sample& s : samples) values.emplace_back(s.motion[axis], s.weight), total += s.weight;
  std::sort(values.begin(), values.end());
  float sum = 0;
  for (const auto& [value, weight] : values)
    if ((sum += weight) * 2 >= total) return value;
  return values.back().first;
}

/// 0 to the sum of weights: how badly a motion fits.
float misfit(const Affine& motion, const Samples& samples, float inlier_px) {
  float sum = 0;
  for (const Sample& s : samples)
    sum += s.weight * (1 - robust((motion * s.place - s.motion).squaredNorm(), inlier_px));
  return sum;
}

/// Iteratively reweighted least squares (Geman–McClure) from a first guess, slopes held back a little so that matches
/// on a line do not tilt the plane.
Affine refitted(Affine motion, const Samples& samples, float inlier_px) {
  constexpr float kSlopePrior_px2 = 20;
  for (const float scale : {4.0F, 2.0F, 1.0F, 1.0F}) {
    Eigen::Matrix3f normal = Eigen::Vector3f(1e-6F, kSlopePrior_px2, kSlopePrior_px2).asDiagonal();
    Affine right = Affine::Zero();
    for (const Sample& s : samples) {
      const float fit = robust((motion * s.place - s.motion).squaredNorm(), scale * inlier_px);
      const float weight = s.weight * fit * fit;
      normal += weight * s.place * s.place.transpose();
      right += weight * s.motion * s.place.transpose();
    }
    motion = normal.ldlt().solve(right.transpose()).transpose();
  }
  return motion;
}

class CellFit {
 public:
  CellFit(const GeodesicCells& cells, const std::vector<SparseMatch>& matches, const InterpolationOptions& options)
      : cells_(cells), options_(options), matches_in_(cells.centres.size()) {
    for (const SparseMatch& match : matches)
      matches_in_[static_cast<std::size_t>(cells.cell(match.at))].push_back(&match);
  }

  std::vector<Affine> fit() {
    const std::size_t num = cells_.centres.size();
    samples_.resize(num);
    motion_.resize(num);
    misfit_.resize(num);
    CellWalk walk(cells_);
    for (std::size_t k = 0; k < num; ++k) fit_cell(walk, k);
    for (int round = 0; round < 2; ++round)
      for (std::size_t k = 0; k < num; ++k) try_neighbours(round == 0 ? k : num - 1 - k);
    return motion_;
  }

 private:
  void fit_cell(CellWalk& walk, std::size_t k) {
    int found = 0;
    const auto& around = walk.from(static_cast<int>(k), [&](int cell) {
      found += static_cast<int>(matches_in_[static_cast<std::size_t>(cell)].size());
      return found >= options_.num_neighbours;
    });
    for (const CellDistance& near : around)
      for (const SparseMatch* match : matches_in_[static_cast<std::size_t>(near.cell)])
        samples_[k].push_back({place(k, match->at),
                               {match->motion.x, match->motion.y},
                               std::exp(-(near.distance - first_distance(around)) / options_.reach)});
    motion_[k].setZero();
    if (samples_[k].empty()) return;
    motion_[k].col(0) = Eigen::Vector2f(weighted_median(samples_[k], 0), weighted_median(samples_[k], 1));
    motion_[k] = refitted(motion_[k], samples_[k], options_.inlier_px);
    misfit_[k] = misfit(motion_[k], samples_[k], options_.inlier_px);
  }

  /// To the nearest cell that has a match.
  float first_distance(const std::vector<CellDistance>& around) const {
    for (const CellDistance& near : around)
      if (!matches_in_[static_cast<std::size_t>(near.cell)].empty()) return near.distance;
    return 0;
  }

  Eigen::Vector3f place(std::size_t k, cv::Point at) const {
    const cv::Point d = at - cells_.centres[k];
    return {1, static_cast<float>(d.x), static_cast<float>(d.y)};
  }

  void try_neighbours(std::size_t k) {
    for (const auto& border : cells_.borders[k]) {
      const auto n = static_cast<std::size_t>(border.to);
      Affine moved = motion_[n];
      moved.col(0) = motion_[n] * place(n, cells_.centres[k]);
      if (misfit(moved, samples_[k], options_.inlier_px) >= misfit_[k]) continue;
      moved = refitted(moved, samples_[k], options_.inlier_px);
      const float left = misfit(moved, samples_[k], options_.inlier_px);
      if (left < misfit_[k]) motion_[k] = moved, misfit_[k] = left;
    }
  }

  const GeodesicCells& cells_;
  const InterpolationOptions& options_;
  std::vector<std::vector<const SparseMatch*>> matches_in_;
  std::vector<Samples> samples_;
  std::vector<Affine> motion_;
  std::vector<float> misfit_;
};

}  // namespace

cv::Mat2f interpolate_matches(const cv::Mat1f& grey, const std::vector<SparseMatch>& matches,
                              const InterpolationOptions& options) {
  cv::Mat2f motion(grey.size(), cv::Vec2f(0, 0));
  if (matches.empty()) return motion;
  const GeodesicCells cells = geodesic_cells(grey, options.cell_px, options.edge_contrast);
  const std::vector<Affine> of_cell = CellFit(cells, matches, options).fit();
  for (int y = 0; y < grey.rows; ++y)
    for (int x = 0; x < grey.cols; ++x) {
      const auto k = static_cast<std::size_t>(cells.cell(y, x));
      const cv::Point d = cv::Point(x, y) - cells.centres[k];
      const Eigen::Vector2f m = of_cell[k] * Eigen::Vector3f(1, static_cast<float>(d.x), static_cast<float>(d.y));
      motion(y, x) = {m.x(), m.y()};
    }
  return motion;
}

}  // namespace vantage
