#include "jobs/correspond/dis_flow.h"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace vantage {
namespace {

struct Levels {
  double middle = 0, spread = 1;
};

/// Median and distance between quartiles, which moving things and highlights hardly change.
Levels levels_of(const cv::Mat1b& grey) {
  std::array<double, 256> counts{};
  for (const uchar value : grey) ++counts[value];
  const auto quantile = [&](double share) {
    double sum = 0;
    for (std::size_t v = 0; v < 256; ++v) {
      const double wanted = share * static_cast<double>(grey.total());
      if (sum + counts[v] >= wanted) return static_cast<double>(v) + (counts[v] > 0 ? (wanted - sum) / counts[v] : 0);
      sum += counts[v];
    }
    return 255.0;
  };
  return {quantile(0.5), std::max(1.0, quantile(0.75) - quantile(0.25))};
}

}  // namespace

cv::Mat2f dis_flow(const cv::Mat1b& from, const cv::Mat1b& to, const cv::Mat2f& start) {
  const auto dis = cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM);
  dis->setFinestScale(0);
  cv::Mat2f motion = start.clone();
  dis->calc(from, to, motion);
  return motion;
}

void refine_flow(const cv::Mat1b& from, const cv::Mat1b& to, cv::Mat2f& motion) {
  const auto refinement = cv::VariationalRefinement::create();
  refinement->setAlpha(20);
  refinement->setDelta(5);
  refinement->setGamma(10);
  refinement->setFixedPointIterations(5);
  refinement->setSorIterations(5);
  refinement->calc(from, to, motion);
}

cv::Mat1b with_levels_of(const cv::Mat1b& reference, const cv::Mat1b& other) {
  const Levels want = levels_of(reference), have = levels_of(other);
  const double gain = std::clamp(want.spread / have.spread, 0.5, 2.0);
  cv::Mat1b levelled;
  other.convertTo(levelled, CV_8U, gain, want.middle - gain * have.middle);
  return levelled;
}

}  // namespace vantage
