#include "jobs/calibrate/plate.h"

#include <algorithm>
#include <cmath>

#include "schema/base/error.h"

namespace vantage {

std::vector<int> spread_frames(int num_frames, int max_frames) {
  const int num = std::min(num_frames, max_frames);
  std::vector<int> frames;
  for (int i = 0; i < num; ++i)
    frames.push_back(num == 1 ? num_frames / 2
                              : static_cast<int>(std::lround(static_cast<double>(i) * (num_frames - 1) / (num - 1))));
  return frames;
}

cv::Mat median_plate(const std::vector<cv::Mat>& pictures) {
  check(!pictures.empty(), "a camera has at least one picture");
  cv::Mat plate(pictures[0].size(), pictures[0].type());
  std::vector<uchar> values(pictures.size());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  const int row_bytes = plate.cols * plate.channels();
  for (int y = 0; y < plate.rows; ++y)
    for (int x = 0; x < row_bytes; ++x) {
      for (std::size_t k = 0; k < pictures.size(); ++k) values[k] = pictures[k].ptr(y)[x];
      std::nth_element(values.begin(), middle, values.end());
      plate.ptr(y)[x] = *middle;
    }
  return plate;
}

}  // namespace vantage
