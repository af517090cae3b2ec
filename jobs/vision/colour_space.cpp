#include "jobs/vision/colour_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "schema/base/error.h"

namespace vantage {
namespace {

/// Linear light of every level of one channel (0 blue, 1 green, 2 red) of 8 or 16 bits.
std::vector<float> linear_table(std::size_t num_levels, const CameraColour& look, int channel) {
  const double gain = look.gain.at(static_cast<std::size_t>(2 - channel));
  std::vector<float> table(num_levels);
  for (std::size_t k = 0; k < num_levels; ++k) {
    const double linear = linear_of_level(255.0 * static_cast<double>(k) / static_cast<double>(num_levels - 1));
    const bool as_filmed = gain == 1 && look.gamma == 1;
    table[k] = static_cast<float>(as_filmed ? linear : gain * kMidGrey * std::pow(linear / kMidGrey, look.gamma));
  }
  return table;
}

template <class Level>
cv::Mat3f through_tables(const cv::Mat_<cv::Vec<Level, 3>>& levels, const std::array<std::vector<float>, 3>& tables) {
  cv::Mat3f linear(levels.size());
  for (int y = 0; y < levels.rows; ++y) {
    const cv::Vec<Level, 3>* from = levels[y];
    cv::Vec3f* to = linear[y];
    for (int x = 0; x < levels.cols; ++x) to[x] = {tables[0][from[x][0]], tables[1][from[x][1]], tables[2][from[x][2]]};
  }
  return linear;
}

std::array<std::vector<float>, 3> linear_tables(std::size_t num_levels, const CameraColour& look) {
  return {linear_table(num_levels, look, 0), linear_table(num_levels, look, 1), linear_table(num_levels, look, 2)};
}

/// sRGB at k / kSteps, for linear interpolation; one more at the end.
constexpr int kSteps = 1 << 14;
const std::vector<float>& srgb_table() {
  static const std::vector<float> table = [] {
    std::vector<float> values(kSteps + 2);
    for (std::size_t k = 0; k < values.size(); ++k)
      values[k] = srgb_from_linear(static_cast<float>(k) / static_cast<float>(kSteps));
    return values;
  }();
  return table;
}

template <class Level>
cv::Mat_<cv::Vec<Level, 3>> levels_of(const cv::Mat3f& linear, float highest) {
  const std::vector<float>& table = srgb_table();
  cv::Mat_<cv::Vec<Level, 3>> levels(linear.size());
  for (int y = 0; y < linear.rows; ++y)
    for (int x = 0; x < linear.cols; ++x)
      for (int c = 0; c < 3; ++c) {
        const float place = std::clamp(linear(y, x)[c], 0.0F, 1.0F) * kSteps;
        const auto k = static_cast<std::size_t>(place);
        const float srgb = table[k] + (place - static_cast<float>(k)) * (table[k + 1] - table[k]);
        levels(y, x)[c] = static_cast<Level>(srgb * highest + 0.5F);
      }
  return levels;
}

}  // namespace

float linear_from_srgb(float value) {
  return static_cast<float>(linear_of_level(255.0 * std::clamp(static_cast<double>(value), 0.0, 1.0)));
}
float srgb_from_linear(float value) { return static_cast<float>(level_of_linear(value) / 255); }

cv::Mat3f linear_from_srgb(const cv::Mat& levels) {
  static const auto tables = linear_tables(256, {});
  if (levels.type() == CV_8UC3) return through_tables<uchar>(levels, tables);
  return linear_from_srgb(levels, {});
}

cv::Mat3f linear_from_srgb(const cv::Mat& levels, const CameraColour& look) {
  check(levels.type() == CV_8UC3 || levels.type() == CV_16UC3, "pictures have 8 or 16 bits and three channels");
  if (levels.depth() == CV_8U) return through_tables<uchar>(levels, linear_tables(256, look));
  return through_tables<ushort>(levels, linear_tables(65536, look));
}

cv::Mat3b srgb8_from_linear(const cv::Mat3f& linear) { return levels_of<uchar>(linear, 255); }
cv::Mat3w srgb16_from_linear(const cv::Mat3f& linear) { return levels_of<ushort>(linear, 65535); }

}  // namespace vantage
