#include "jobs/sync/scan_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace vantage::sync {

cv::Mat scan_picture(const OffsetScan& scan, double answer_s, bool determined) {
  constexpr int kWidth = 480, kHeight = 160, kMargin = 20;
  cv::Mat picture(kHeight, kWidth, CV_8UC3, cv::Scalar::all(32));
  const double span = std::max(scan.range.max_s - scan.range.min_s, scan.range.step_s);
  const auto x_of = [&](double offset_s) {
    return kMargin + cvRound((offset_s - scan.range.min_s) / span * (kWidth - 2 * kMargin));
  };
  const cv::Scalar colour = determined ? cv::Scalar(80, 200, 80) : cv::Scalar(60, 60, 230);
  cv::line(picture, {x_of(answer_s), kMargin}, {x_of(answer_s), kHeight - kMargin}, colour, 2);
  double highest = 1e-9;
  for (const double score : scan.scores) highest = std::max(highest, score);
  std::vector<cv::Point> curve;
  for (std::size_t k = 0; k < scan.scores.size(); ++k)
    curve.emplace_back(x_of(scan.range.at(static_cast<int>(k))),
                       kHeight - kMargin - cvRound(scan.scores[k] / highest * (kHeight - 2 * kMargin)));
  if (!curve.empty()) cv::polylines(picture, curve, false, cv::Scalar::all(230), 1, cv::LINE_AA);
  const auto label = [&](const std::string& text, int x) {
    cv::putText(picture, text, {x, kHeight - 5}, cv::FONT_HERSHEY_SIMPLEX, 0.4, cv::Scalar::all(200), 1, cv::LINE_AA);
  };
  label(fmt::format("{:+.2f} s", scan.range.min_s), 5);
  label(fmt::format("{:+.2f} s", scan.range.max_s), kWidth - 60);
  label(fmt::format("{:+.4f} s", answer_s), kWidth / 2 - 30);
  return picture;
}

}  // namespace vantage::sync
