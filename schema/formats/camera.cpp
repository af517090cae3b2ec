#include "schema/formats/camera.h"

#include <fmt/format.h>

namespace vantage {

std::string ImageId::label() const { return fmt::format("{}-{:06d}", camera, frame); }

std::optional<ImageId> ImageId::parse(const std::string& label) {
  const std::size_t dash = label.rfind('-');
  if (dash == std::string::npos || dash == 0 || dash + 1 == label.size()) return std::nullopt;
  const std::string digits = label.substr(dash + 1);
  if (digits.find_first_not_of("0123456789") != std::string::npos || digits.size() > 9) return std::nullopt;
  return ImageId{label.substr(0, dash), std::stoi(digits)};
}

Eigen::Matrix3d Pinhole::K() const {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = fx;
  k(1, 1) = fy;
  k(0, 2) = cx;
  k(1, 2) = cy;
  return k;
}

}  // namespace vantage
