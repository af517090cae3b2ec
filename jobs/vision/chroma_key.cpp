#include "jobs/vision/chroma_key.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace vantage {
namespace {

constexpr float kSameHue = 0.2F;      ///< off the key's direction, of its length: may be screen
constexpr float kSameColour = 0.08F;  ///< off the screen beside it, of its length: is screen, with noise
constexpr float kDarkest = 0.5F;      ///< of the screen's usual light
constexpr float kSolid = 0.9F;        ///< bound of alpha from which a pixel can be solid
constexpr float kNoise = 0.02F;       ///< alpha this near 0 or 1 is 0 or 1

float part_along(const cv::Vec3f& colour, const cv::Vec3f& direction) {
  return colour.dot(direction) / std::max(direction.dot(direction), 1e-9F);
}

/// Pixels of the key's hue, whose light is not far from the usual.
cv::Mat1b screen_candidates(const cv::Mat3f& bgr, const cv::Vec3f& key) {
  cv::Mat1b candidates(bgr.size(), uchar{0});
  std::vector<float> lights;
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x) {
      const float light = part_along(bgr(y, x), key);
      if (light <= 0 || cv::norm(bgr(y, x) - light * key) > kSameHue * light * cv::norm(key)) continue;
      candidates(y, x) = 255;
      lights.push_back(light);
    }
  if (lights.empty()) return candidates;
  const auto middle = lights.begin() + static_cast<std::ptrdiff_t>(lights.size() / 2);
  std::nth_element(lights.begin(), middle, lights.end());
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x)
      if (part_along(bgr(y, x), key) < kDarkest * *middle) candidates(y, x) = 0;
  return candidates;
}

/// Mean colour of the sure pixels around each of them; elsewhere that of the nearest one. Some pixel must be sure.
cv::Mat3f spread(const cv::Mat3f& bgr, const cv::Mat1b& sure, int radius_px) {
  cv::Mat1f weight;
  sure.convertTo(weight, CV_32F, 1 / 255.0);
  cv::Mat3f sum(bgr.size(), cv::Vec3f(0, 0, 0));
  bgr.copyTo(sum, sure);
  const cv::Size window(2 * radius_px + 1, 2 * radius_px + 1);
  cv::boxFilter(sum, sum, -1, window, {-1, -1}, false, cv::BORDER_CONSTANT);
  cv::boxFilter(weight, weight, -1, window, {-1, -1}, false, cv::BORDER_CONSTANT);
  cv::Mat1f distance;
  cv::Mat1i labels;
  cv::distanceTransform(sure == 0, distance, labels, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
  std::vector<cv::Vec3f> means(sure.total() + 1);
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x)
      if (sure(y, x)) means[static_cast<std::size_t>(labels(y, x))] = sum(y, x) * (1 / weight(y, x));
  cv::Mat3f out(bgr.size());
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x) out(y, x) = means[static_cast<std::size_t>(labels(y, x))];
  return out;
}

struct Bounds {
  float low, high;
};

/// Of alpha: the foreground has no negative channel, and no more of the key's channel than of its greatest other one.
Bounds alpha_bounds(const cv::Vec3f& colour, const cv::Vec3f& screen, int key_channel) {
  float most_screen = 1, least_screen = 1;
  for (int c = 0; c < 3; ++c) {
    if (screen[c] > 1e-4F) most_screen = std::min(most_screen, colour[c] / screen[c]);
    if (c == key_channel) continue;
    const float more = screen[key_channel] - screen[c];
    if (more > 1e-4F) least_screen = std::min(least_screen, (colour[key_channel] - colour[c]) / more);
  }
  const float low = std::clamp(1 - most_screen, 0.0F, 1.0F);
  return {low, std::max(low, std::clamp(1 - least_screen, 0.0F, 1.0F))};
}

/// Pixels that are surely foreground: bounds that let them be solid, and no screen within radius_px.
cv::Mat1b solid_pixels(const cv::Mat3f& bgr, const cv::Mat3f& screen, const cv::Mat1b& is_screen, int key_channel,
                       float radius_px) {
  cv::Mat1f distance;
  cv::distanceTransform(is_screen == 0, distance, cv::DIST_L2, cv::DIST_MASK_5);
  cv::Mat1b solid(bgr.size(), uchar{0});
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x)
      if (distance(y, x) > radius_px && alpha_bounds(bgr(y, x), screen(y, x), key_channel).high >= kSolid)
        solid(y, x) = 255;
  return solid;
}

/// What the screen reflects is held down to the greatest other channel.
cv::Vec3f without_spill(cv::Vec3f colour, int key_channel) {
  const float others = std::max(colour[(key_channel + 1) % 3], colour[(key_channel + 2) % 3]);
  colour[key_channel] = std::min(colour[key_channel], others);
  for (int c = 0; c < 3; ++c) colour[c] = std::max(0.0F, colour[c]);
  return colour;
}

float edge_alpha(const cv::Vec3f& colour, const cv::Vec3f& screen, const cv::Vec3f& foreground, const Bounds& bounds) {
  const float alpha = std::clamp(part_along(colour - screen, foreground - screen), bounds.low, bounds.high);
  return std::clamp((alpha - kNoise) / (1 - 2 * kNoise), 0.0F, 1.0F);
}

}  // namespace

KeyedPicture chroma_key(const cv::Mat3f& bgr, const cv::Vec3f& key) {
  KeyedPicture keyed{bgr.clone(), cv::Mat1f(bgr.size(), 1.0F)};
  const int key_channel = static_cast<int>(std::max_element(key.val, key.val + 3) - key.val);
  const cv::Mat1b candidates = screen_candidates(bgr, key);
  if (cv::countNonZero(candidates) == 0) return keyed;
  const cv::Mat3f screen = spread(bgr, candidates, std::max(3, bgr.cols / 40));
  cv::Mat1b is_screen(bgr.size(), uchar{0});
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x)
      if (cv::norm(bgr(y, x) - screen(y, x)) < kSameColour * cv::norm(screen(y, x))) is_screen(y, x) = 255;
  const cv::Mat1b solid =
      solid_pixels(bgr, screen, is_screen, key_channel, std::max(2.0F, static_cast<float>(bgr.cols) / 320));
  const bool some_solid = cv::countNonZero(solid) > 0;
  const cv::Mat3f foreground = some_solid ? spread(bgr, solid, 2) : bgr;
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x) {
      float& alpha = keyed.alpha(y, x);
      if (is_screen(y, x))
        alpha = 0;
      else if (!solid(y, x))
        alpha = edge_alpha(bgr(y, x), screen(y, x), without_spill(foreground(y, x), key_channel),
                           alpha_bounds(bgr(y, x), screen(y, x), key_channel));
      keyed.bgr(y, x) =
          alpha > 0 ? without_spill(bgr(y, x) - (1 - alpha) * screen(y, x), key_channel) : cv::Vec3f(0, 0, 0);
    }
  return keyed;
}

}  // namespace vantage
