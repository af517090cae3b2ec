#include "jobs/depth/depth_preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

namespace vantage {
namespace {

constexpr int kTileWidth_px = 600;

cv::Mat3b tile(const cv::Mat& picture) {
  const int height = std::max(1, kTileWidth_px * picture.rows / picture.cols);
  const bool shrinks = picture.cols > kTileWidth_px;
  cv::Mat3b out;
  cv::resize(picture, out, {kTileWidth_px, height}, 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_NEAREST);
  return out;
}

cv::Mat3b grey(const cv::Mat1f& share) {
  cv::Mat1b levels;
  share.convertTo(levels, CV_8U, 255);
  cv::Mat3b out;
  cv::cvtColor(levels, out, cv::COLOR_GRAY2BGR);
  return out;
}

void caption(cv::Mat3b& tile, const std::string& text) {
  for (const auto& [colour, thickness] : {std::pair(0, 3), std::pair(255, 1)})
    cv::putText(tile, text, {8, tile.rows - 10}, cv::FONT_HERSHEY_SIMPLEX, 0.5, cv::Scalar::all(colour), thickness,
                cv::LINE_AA);
}

/// "red 2.31, blue 9.80 world units": the ends of depth_picture's colours.
std::string legend(const cv::Mat1f& z) {
  std::vector<float> known;
  std::copy_if(z.begin(), z.end(), std::back_inserter(known), [](float v) { return v > 0; });
  if (known.size() < 2) return "depth: nothing known";
  const auto at = [&](double share) {
    const auto k = known.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(known.size() - 1));
    std::nth_element(known.begin(), k, known.end());
    return *k;
  };
  return fmt::format("depth: red {:.3g}, blue {:.3g} world units, black unknown", at(0.02), at(0.98));
}

}  // namespace

cv::Mat3b depth_preview(const cv::Mat3b& bgr, const DepthMap& depth, const cv::Mat1f& edges_agree) {
  std::vector<cv::Mat3b> tiles{tile(bgr), tile(depth_picture(depth)), tile(grey(depth.confidence)),
                               tile(grey(edges_agree))};
  caption(tiles[1], legend(depth.z));
  caption(tiles[2], "confidence");
  caption(tiles[3], "agreement of the image's own edges");
  cv::Mat3b top, bottom, all;
  cv::hconcat(tiles[0], tiles[1], top);
  cv::hconcat(tiles[2], tiles[3], bottom);
  cv::vconcat(top, bottom, all);
  return all;
}

}  // namespace vantage
