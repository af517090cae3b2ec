#include "jobs/encode/layout.h"

#include <opencv2/imgproc.hpp>

#include "schema/base/error.h"

namespace vantage {

cv::Mat lay_out(const cv::Mat& left, const cv::Mat& right, const std::string& layout) {
  check(left.size() == right.size() && left.type() == right.type(), "both eyes have one size");
  if (layout == "left") return left;
  if (layout == "right") return right;
  if (layout == "anaglyph") return anaglyph(left, right);
  cv::Mat both;
  const bool beside = layout.starts_with("side_by_side");
  check(beside || layout.starts_with("over_under"), "a layout of two eyes is known: " + layout);
  beside ? cv::hconcat(left, right, both) : cv::vconcat(left, right, both);
  if (!layout.ends_with("_half")) return both;
  cv::Mat half;
  cv::resize(both, half, left.size(), 0, 0, cv::INTER_AREA);
  return half;
}

int frame_packing(const std::string& layout) {
  return layout.starts_with("side_by_side") ? 3 : layout.starts_with("over_under") ? 4 : 0;
}

}  // namespace vantage
