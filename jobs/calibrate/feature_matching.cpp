#include "jobs/calibrate/feature_matching.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace vantage {
namespace {

constexpr Eigen::Index kRowsAtOnce = 512;  // of the matrix of products: 8 MB beside 4096 features

/// The largest and second largest product with a feature; products of unit vectors fall as distances rise.
struct TwoBest {
  float first = -1, second = -1;
  int index = -1;
  void offer(float product, int i) {
    if (product > first) {
      second = first;
      first = product;
      index = i;
    } else if (product > second) {
      second = product;
    }
  }
  bool is_distinct(double max_ratio) const {
    if (index < 0) return false;
    const double d1 = std::max(0.0, 2 - 2.0 * first), d2 = std::max(0.0, 2 - 2.0 * second);
    return d1 < max_ratio * max_ratio * d2;
  }
};

Eigen::Matrix3Xf lines_of(const Eigen::Matrix3d& F, const std::vector<Eigen::Vector2d>& px) {
  Eigen::Matrix3Xf lines(3, static_cast<Eigen::Index>(px.size()));
  for (std::size_t i = 0; i < px.size(); ++i) {
    const Eigen::Vector3d line = F * px[i].homogeneous();
    lines.col(static_cast<Eigen::Index>(i)) = (line / line.head<2>().norm()).cast<float>();
  }
  return lines;
}

/// Whether two features lie on each other's epipolar lines.
class BandTest {
 public:
  BandTest(const Features& a, const Features& b, const EpipolarBand& band)
      : a_(a.px),
        b_(b.px),
        in_b_(lines_of(band.F, a.px)),
        in_a_(lines_of(band.F.transpose(), b.px)),
        max_px_(static_cast<float>(band.max_px)) {}
  bool holds(Eigen::Index i, Eigen::Index j) const {
    return near(in_b_.col(i), b_[static_cast<std::size_t>(j)]) && near(in_a_.col(j), a_[static_cast<std::size_t>(i)]);
  }

 private:
  bool near(const Eigen::Vector3f& line, const Eigen::Vector2d& px) const {
    return std::abs(line.x() * static_cast<float>(px.x()) + line.y() * static_cast<float>(px.y()) + line.z()) <=
           max_px_;
  }
  const std::vector<Eigen::Vector2d>&a_, &b_;
  Eigen::Matrix3Xf in_b_, in_a_;
  float max_px_;
};

}  // namespace

std::vector<FeatureMatch> match_features(const Features& a, const Features& b, double max_ratio,
                                         const std::optional<EpipolarBand>& band) {
  std::optional<BandTest> test;
  if (band) test.emplace(a, b, *band);
  std::vector<TwoBest> of_a(a.size()), of_b(b.size());
  Eigen::MatrixXf products;
  for (Eigen::Index first = 0; first < a.descriptors.rows(); first += kRowsAtOnce) {
    const auto num = std::min(kRowsAtOnce, a.descriptors.rows() - first);
    products.noalias() = a.descriptors.middleRows(first, num) * b.descriptors.transpose();
    for (Eigen::Index j = 0; j < products.cols(); ++j)
      for (Eigen::Index i = 0; i < num; ++i) {
        if (test && !test->holds(first + i, j)) continue;
        of_a[static_cast<std::size_t>(first + i)].offer(products(i, j), static_cast<int>(j));
        of_b[static_cast<std::size_t>(j)].offer(products(i, j), static_cast<int>(first + i));
      }
  }
  std::vector<FeatureMatch> out;
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    if (!of_a[i].is_distinct(max_ratio)) continue;
    const auto& back = of_b[static_cast<std::size_t>(of_a[i].index)];
    if (back.index == static_cast<int>(i) && back.is_distinct(max_ratio))
      out.push_back({static_cast<int>(i), of_a[i].index});
  }
  return out;
}

}  // namespace vantage
