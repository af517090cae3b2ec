#include "jobs/calibrate/picture_pair.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

namespace vantage {
namespace {

constexpr int kMaxHypotheses = 20000;  // seven right matches of every four: one in 16,000

using Matches = std::vector<FeatureMatch>;

/// All glimpses that two pictures have at the same moments.
Matches match_glimpses(const Survey::Picture& a, const Survey::Picture& b, double max_ratio,
                       const std::optional<EpipolarBand>& band) {
  Matches out;
  int first_a = 0;
  for (const auto& in_a : a.glimpses) {
    int first_b = 0;
    for (const auto& in_b : b.glimpses) {
      if (in_a.moment == in_b.moment)
        for (const auto& m : match_features(in_a.features, in_b.features, max_ratio, band))
          out.push_back({first_a + m.a, first_b + m.b});
      first_b += static_cast<int>(in_b.features.size());
    }
    first_a += static_cast<int>(in_a.features.size());
  }
  return out;
}

std::vector<Eigen::Vector2d> all_px(const Survey::Picture& picture) {
  std::vector<Eigen::Vector2d> out;
  for (const auto& glimpse : picture.glimpses)
    out.insert(out.end(), glimpse.features.px.begin(), glimpse.features.px.end());
  return out;
}

/// Matches of two pictures and where they lie.
class Candidates {
 public:
  Candidates(const Survey::Picture& a, const Survey::Picture& b) : px_a_(all_px(a)), px_b_(all_px(b)) {}

  std::optional<Eigen::Matrix3d> robust_F(const Matches& matches, double max_error_px) const {
    if (matches.size() < 8) return std::nullopt;
    std::vector<cv::Point2d> in_a, in_b;
    for (const auto& m : matches) {
      in_a.push_back(point(px_a_, m.a));
      in_b.push_back(point(px_b_, m.b));
    }
    cv::UsacParams params;
    params.confidence = 0.9999;
    params.maxIterations = kMaxHypotheses;
    params.threshold = max_error_px;
    params.score = cv::SCORE_METHOD_MAGSAC;
    params.loMethod = cv::LOCAL_OPTIM_SIGMA;
    params.sampler = cv::SAMPLING_UNIFORM;
    params.randomGeneratorState = 1;
    cv::Mat used;
    const cv::Mat found = cv::findFundamentalMat(in_a, in_b, used, params);
    if (found.rows != 3) return std::nullopt;
    Eigen::Matrix3d F;
    cv::cv2eigen(found, F);
    return F;
  }

  Matches near(const Matches& matches, const Eigen::Matrix3d& F, double max_error_px) const {
    Matches out;
    for (const auto& m : matches)
      if (sampson_px(F, px_a_[index(m.a)], px_b_[index(m.b)]) <= max_error_px) out.push_back(m);
    return out;
  }

  /// How many unrelated matches may lie near the lines of the geometry that suits them best: what a band covers of the
  /// region that they fill, along its length, four standard deviations up for the choice among thousands, and the seven
  /// that define it.
  double most_by_chance(const Matches& matches, double max_error_px) const {
    Eigen::Matrix2Xd px(2, static_cast<Eigen::Index>(matches.size()));
    for (std::size_t i = 0; i < matches.size(); ++i) px.col(static_cast<Eigen::Index>(i)) = px_b_[index(matches[i].b)];
    px.colwise() -= px.rowwise().mean().eval();
    const Eigen::Matrix2d scatter = px * px.transpose() / static_cast<double>(matches.size());
    const double least_variance = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(scatter).eigenvalues().x();
    const double width_px = std::sqrt(12 * std::max(1.0, least_variance));  // of a box that scatters as much
    const double band_px = 2 * std::sqrt(2.0) * max_error_px;               // Sampson's distance counts both pictures
    const double expected = std::min(1.0, band_px / width_px) * static_cast<double>(matches.size());
    return 8 + expected + 4 * std::sqrt(expected);
  }

 private:
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  static cv::Point2d point(const std::vector<Eigen::Vector2d>& px, int i) {
    return {px[index(i)].x(), px[index(i)].y()};
  }
  static double sampson_px(const Eigen::Matrix3d& F, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const Eigen::Vector3d in_b = F * a.homogeneous(), in_a = F.transpose() * b.homogeneous();
    return std::abs(b.homogeneous().dot(in_b)) / std::sqrt(in_b.head<2>().squaredNorm() + in_a.head<2>().squaredNorm());
  }
  std::vector<Eigen::Vector2d> px_a_, px_b_;
};

}  // namespace

PicturePair match_pictures(const Survey& survey, int a, int b, const MatchOptions& options) {
  const auto& in_a = survey.pictures[static_cast<std::size_t>(a)];
  const auto& in_b = survey.pictures[static_cast<std::size_t>(b)];
  const Candidates candidates(in_a, in_b);
  PicturePair out{.a = a, .b = b, .matches = {}};
  const Matches all = match_glimpses(in_a, in_b, options.max_ratio, std::nullopt);
  const auto F = candidates.robust_F(all, options.max_error_px);
  if (!F) return out;
  const Matches first = candidates.near(all, *F, options.max_error_px);
  if (static_cast<double>(first.size()) < candidates.most_by_chance(all, options.max_error_px)) return out;
  const Matches guided =
      match_glimpses(in_a, in_b, options.guided_ratio, EpipolarBand{.F = *F, .max_px = options.max_error_px});
  const auto refined = candidates.robust_F(guided, options.max_error_px);
  if (!refined) return out;
  out.F = *refined;
  out.matches = candidates.near(guided, out.F, options.max_error_px);
  return out;
}

}  // namespace vantage
