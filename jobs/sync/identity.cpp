#include "jobs/sync/identity.h"

#include <algorithm>
#include <cmath>

namespace vantage::sync {
namespace {

/// All looks of all tracks as unit columns, and where each track's begin.
struct Looks {
  Eigen::MatrixXf columns;
  std::vector<Eigen::Index> first;
};

Looks gather(const std::vector<TimedTrack>& tracks) {
  Looks looks;
  Eigen::Index num = 0;
  for (const auto& track : tracks) {
    looks.first.push_back(num);
    num += std::ssize(track.looks);
  }
  looks.first.push_back(num);
  looks.columns.resize(128, num);
  Eigen::Index column = 0;
  for (const auto& track : tracks)
    for (const auto& look : track.looks) {
      for (std::size_t d = 0; d < look.size(); ++d) looks.columns(static_cast<Eigen::Index>(d), column) = look[d];
      looks.columns.col(column++).normalize();
    }
  return looks;
}

/// tracks of a × tracks of b: greatest cosine between any two of their looks.
Eigen::MatrixXf similarities(const std::vector<TimedTrack>& a, const std::vector<TimedTrack>& b) {
  const Looks looks_a = gather(a), looks_b = gather(b);
  Eigen::MatrixXf best(std::ssize(a), std::ssize(b));
  for (Eigen::Index i = 0; i < best.rows(); ++i) {
    const auto begin = static_cast<std::size_t>(i);
    const Eigen::MatrixXf cosines =
        looks_a.columns.middleCols(looks_a.first[begin], looks_a.first[begin + 1] - looks_a.first[begin]).transpose() *
        looks_b.columns;
    for (Eigen::Index j = 0; j < best.cols(); ++j) {
      const Eigen::Index from = looks_b.first[static_cast<std::size_t>(j)];
      best(i, j) = cosines.middleCols(from, looks_b.first[static_cast<std::size_t>(j) + 1] - from).maxCoeff();
    }
  }
  return best;
}

}  // namespace

std::vector<TrackMatch> match_by_look(const std::vector<TimedTrack>& a, const std::vector<TimedTrack>& b, int num_best,
                                      double max_distance) {
  std::vector<TrackMatch> matches;
  if (a.empty() || b.empty()) return matches;
  const Eigen::MatrixXf alike = similarities(a, b);
  std::vector<Eigen::Index> best_a(b.size());
  for (std::size_t j = 0; j < b.size(); ++j) alike.col(static_cast<Eigen::Index>(j)).maxCoeff(&best_a[j]);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::vector<TrackMatch> row;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const double cosine = alike(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      row.push_back({i, j, std::sqrt(std::max(0.0, 2 - 2 * cosine)), false});
    }
    std::stable_sort(row.begin(), row.end(), [](auto& p, auto& q) { return p.distance < q.distance; });
    row.front().mutual = best_a[row.front().b] == static_cast<Eigen::Index>(i);
    for (std::size_t k = 0; k < row.size() && k < static_cast<std::size_t>(num_best); ++k)
      if (row[k].distance <= max_distance) matches.push_back(row[k]);
  }
  return matches;
}

}  // namespace vantage::sync
