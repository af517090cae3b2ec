#pragma once
#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

namespace vantage {

/// Points of a picture that can be recognised in others.
struct Features {
  using Descriptors = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::vector<Eigen::Vector2d> px;   ///< in the picture's pixels, centres at +0.5
  std::vector<Eigen::Vector3i> rgb;  ///< the picture's colour there
  Descriptors descriptors;           ///< a unit row of 128 for each
  std::size_t size() const { return px.size(); }
};

struct FeatureOptions {
  int max_side_px = 1600;  ///< larger pictures are shrunk to it, smaller ones at most doubled
  int max_features = 4096;
  bool faint = false;  ///< less contrast suffices
};

/// SIFT (Lowe 2004) with square-rooted descriptors (Arandjelovic & Zisserman 2012, "RootSIFT"), so that the Euclidean
/// distance compares histograms by Hellinger's kernel. bgr: 8-bit. mask: 8-bit of the same size, 0 where nothing is to
/// be found; empty: everywhere. The same picture gives the same features in the same order.
Features find_features(const cv::Mat& bgr, const cv::Mat& mask, const FeatureOptions& options);

}  // namespace vantage
