#include "jobs/render/behind_edges.h"

#include <opencv2/imgproc.hpp>

namespace vantage {

namespace {
constexpr double kEdge = 1.04;  ///< ratio of depths: no slope seen at less than about 87 degrees is as steep
constexpr double kBeside = 0.3, kNext = 0.7;
}  // namespace

cv::Mat1f worth_behind_edges(const cv::Mat1f& z) {
  cv::Mat1f worth(z.size(), 1.0F);
  cv::Mat nearest;
  cv::erode(z, nearest, cv::Mat::ones(5, 5, CV_8U));
  worth.setTo(kNext, nearest * kEdge < z);
  cv::erode(z, nearest, cv::Mat::ones(3, 3, CV_8U));
  worth.setTo(kBeside, nearest * kEdge < z);
  return worth;
}

}  // namespace vantage
