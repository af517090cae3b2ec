#include "tests/jobs/correspond/moving_layers.h"

#include <opencv2/core/utility.hpp>

namespace vantage::synthetic {
namespace {

/// The texture's finest octave, 3 cm, is 3 px wide.
constexpr double kMetresPerPixel = 0.03 / 3;

cv::Point2d turned(const Layer& layer, cv::Point2d at, double direction) {
  const double c = std::cos(direction * layer.turn_rad), s = std::sin(direction * layer.turn_rad);
  return {c * at.x - s * at.y, s * at.x + c * at.y};
}

cv::Point2d end_of(const Layer& layer, cv::Point2d at) {
  return layer.centre_px + turned(layer, at - layer.centre_px, 1) + cv::Point2d(layer.motion_px);
}

cv::Point2d start_of(const Layer& layer, cv::Point2d end) {
  return layer.centre_px + turned(layer, end - cv::Point2d(layer.motion_px) - layer.centre_px, -1);
}

bool covers(const Layer& layer, cv::Point2d at) {
  return layer.radius_px == 0 || std::hypot(at.x - layer.centre_px.x, at.y - layer.centre_px.y) < layer.radius_px;
}

double grey_of(int layer, cv::Point2d at) {
  const Eigen::Vector3d colour = solid_texture(layer, {kMetresPerPixel * at.x, kMetresPerPixel * at.y, 0.1 * layer});
  return 127.5 + 90 * std::sin(20 * colour.mean());  // folded: every layer is as rich in contrast
}

/// Index of the front layer at a place of a, or of b.
std::size_t front(const std::vector<Layer>& layers, cv::Point2d at, bool in_b) {
  for (std::size_t k = layers.size(); k-- > 1;)
    if (covers(layers[k], in_b ? start_of(layers[k], at) : at)) return k;
  return 0;
}

cv::Mat1b render(cv::Size size, const std::vector<Layer>& layers, bool in_b, double noise_grey) {
  cv::Mat1b picture(size);
  cv::RNG random(in_b ? 2 : 1);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const cv::Point2d at(x, y);
      const std::size_t k = front(layers, at, in_b);
      const double grey = grey_of(static_cast<int>(k), in_b ? start_of(layers[k], at) : at);
      picture(y, x) = cv::saturate_cast<uchar>(grey + random.gaussian(noise_grey));
    }
  return picture;
}

}  // namespace

LayeredPair render_layers(cv::Size size, const std::vector<Layer>& layers, double noise_grey) {
  LayeredPair pair{render(size, layers, false, noise_grey), render(size, layers, true, noise_grey), cv::Mat2f(size),
                   cv::Mat1b(size), cv::Mat1b(size)};
  const cv::Rect2d inside(-0.5, -0.5, size.width, size.height);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const cv::Point2d at(x, y);
      const std::size_t k = front(layers, at, false);
      const cv::Point2d end = end_of(layers[k], at), motion = end - at;
      pair.layer(y, x) = static_cast<uchar>(k);
      pair.a_to_b(y, x) = {static_cast<float>(motion.x), static_cast<float>(motion.y)};
      pair.visible(y, x) = inside.contains(end) && front(layers, end, true) == k ? 255 : 0;
    }
  return pair;
}

}  // namespace vantage::synthetic
