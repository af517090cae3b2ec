#include "jobs/depth/outlines.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "jobs/depth/colour_weight.h"

namespace vantage {
namespace {

/// A step of inverse depth between neighbours that no surface explains: at 640 px and 45°, 4 % a pixel is 88° slant.
constexpr float kStepShare = 0.04F;
constexpr int kRadius = 5;  ///< of the neighbourhood, in taps
constexpr double kSigmaTaps = 3;
constexpr double kSigmaColour = 14;  ///< 8-bit levels
/// How many times likelier the other side's colours must be.
constexpr float kPrior = 4;
constexpr float kFloor = 1e-6F;   ///< likelihood of a colour that is on neither side
constexpr float kFewest = 1e-3F;  ///< weight below which a side is as good as absent
/// Rims are as wide as in the pictures that were matched, which are no wider than this.
constexpr int kMatchedWidth_px = 960;

struct Tap {
  int x, y;
  float weight;
};

std::vector<Tap> taps(int stride_px) {
  std::vector<Tap> all;
  for (int v = -kRadius; v <= kRadius; ++v)
    for (int u = -kRadius; u <= kRadius; ++u)
      all.push_back({u * stride_px, v * stride_px,
                     static_cast<float>(std::exp(-(u * u + v * v) / (2 * kSigmaTaps * kSigmaTaps)))});
  return all;
}

/// Known pixels at a step of depth or next to one.
cv::Mat1b rim_of(const cv::Mat1f& inverse_depth, int width_px) {
  constexpr float kNone = 1e30F;
  cv::Mat1f high, low = inverse_depth.clone();
  low.setTo(kNone, inverse_depth <= 0);
  cv::dilate(inverse_depth, high, {});
  cv::erode(low, low, {});
  const cv::Mat1b known(inverse_depth > 0);
  cv::Mat1b rim(high - low > kStepShare * high);
  rim &= known;
  cv::dilate(rim, rim, {}, {-1, -1}, width_px);
  rim &= known;
  return rim;
}

/// One side of a step: how like the pixel it is, and its inverse depth.
struct Side {
  float alike = 0, total = 0;
  float sum = 0, total_near = 0;
  void add(float inverse_depth, float weight, float colour) {
    const float nearer = weight * weight * weight;
    alike += weight * colour;
    total += weight;
    sum += nearer * inverse_depth;
    total_near += nearer;
  }
  float likelihood() const { return alike / total + kFloor; }
  float inverse_depth() const { return sum / total_near; }
};

struct Neighbour {
  float inverse_depth, weight, colour;
};

/// The inverse depth of the side that the pixel should move to; empty when it stays.
std::optional<float> better_side(const std::vector<Neighbour>& around, float own) {
  const auto [low, high] =
      std::minmax_element(around.begin(), around.end(),
                          [](const Neighbour& a, const Neighbour& b) { return a.inverse_depth < b.inverse_depth; });
  if (around.empty() || high->inverse_depth - low->inverse_depth <= kStepShare * high->inverse_depth) return {};
  const float middle = 0.5F * (low->inverse_depth + high->inverse_depth);
  Side far, near;
  for (const Neighbour& n : around) (n.inverse_depth > middle ? near : far).add(n.inverse_depth, n.weight, n.colour);
  if (near.total < kFewest || far.total < kFewest) return {};
  const Side &mine = own > middle ? near : far, &other = own > middle ? far : near;
  if (other.likelihood() <= kPrior * mine.likelihood()) return {};
  return other.inverse_depth();
}

}  // namespace

void align_outlines(cv::Mat1f& inverse_depth, cv::Mat1f& confidence, const cv::Mat3b& guide) {
  const int stride_px = std::max(1, cvRound(static_cast<double>(inverse_depth.cols) / kMatchedWidth_px));
  const cv::Mat1b rim = rim_of(inverse_depth, stride_px);
  const std::vector<Tap> around = taps(stride_px);
  const ColourWeight alike(kSigmaColour);
  const cv::Mat1f before = inverse_depth.clone();
  const cv::Rect frame({}, before.size());
  std::vector<Neighbour> neighbours;
  for (int y = 0; y < before.rows; ++y)
    for (int x = 0; x < before.cols; ++x) {
      if (!rim(y, x)) continue;
      neighbours.clear();
      for (const Tap& tap : around) {
        const cv::Point at(x + tap.x, y + tap.y);
        if (frame.contains(at) && before(at) > 0 && !rim(at))
          neighbours.push_back({before(at), tap.weight, alike(guide(at), guide(y, x))});
      }
      if (const auto moved = better_side(neighbours, before(y, x))) {
        inverse_depth(y, x) = *moved;
        confidence(y, x) = std::min(confidence(y, x), kMovedConfidence);
      }
    }
}

}  // namespace vantage
