#include "jobs/render/blend.h"

#include <algorithm>
#include <cmath>

#include "jobs/render/resample.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr float kSame = 0.03F, kInFront = 0.08F;   ///< of depth: one surface up to the one, two from the other on
constexpr float kError = 0.02F, kSurface = 0.15F;  ///< of all weight: less than the one is an error of depth
constexpr float kNegligible = 0.004F;              ///< of all weight: less than half a level
constexpr float kDisagreement = 50 / 255.0F;       ///< of the root of linear light, which is nearly sRGB

float smooth_step(float from, float to, float value) {
  const float t = std::clamp((value - from) / (to - from), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

/// 1 for equal colours (roots of linear light), a half at kDisagreement, soon less beyond.
float likeness(const cv::Vec3f& a, const cv::Vec3f& b) {
  const float db = a[0] - b[0], dg = a[1] - b[1], dr = a[2] - b[2];
  const float apart2 = (db * db + dg * dg + dr * dr) * (1 / (kDisagreement * kDisagreement));
  return 1 / (1 + apart2 * apart2);
}

/// Bilinear, beyond the rim the rim; 1 without a matte.
float alpha_at(const cv::Mat1f& alpha, const cv::Vec2f& px) {
  if (alpha.empty()) return 1;
  const float x = std::clamp(px[0] - 0.5F, 0.0F, static_cast<float>(alpha.cols - 1)),
              y = std::clamp(px[1] - 0.5F, 0.0F, static_cast<float>(alpha.rows - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, alpha.cols - 1), y1 = std::min(y0 + 1, alpha.rows - 1);
  const float a = x - static_cast<float>(x0), b = y - static_cast<float>(y0);
  return (1 - b) * ((1 - a) * alpha(y0, x0) + a * alpha(y0, x1)) + b * ((1 - a) * alpha(y1, x0) + a * alpha(y1, x1));
}

struct Candidate {
  std::size_t layer;
  float z, order, weight;
  float confidence;
  cv::Vec3f bgr, root;  ///< linear light, and its root
};

/// One pixel's candidates, used for pixel after pixel.
class Mixer {
 public:
  explicit Mixer(const std::vector<PictureLayer>& layers) : layers_(layers) {}

  void mix(int y, int x, ViewPicture& picture) {
    gather(y, x);
    if (candidates_.empty()) return;
    see_through();
    sample(y, x);
    if (candidates_.empty()) return;
    agree();
    write(y, x, picture);
  }

 private:
  void gather(int y, int x) {
    candidates_.clear();
    for (std::size_t k = 0; k < layers_.size(); ++k) {
      const Layer& layer = layers_[k].layer;
      const float z = layer.z(y, x);
      if (z <= 0) continue;
      const float confidence = layer.confidence(y, x);
      candidates_.push_back({k, z, layer.order(y, x), layers_[k].share * confidence, confidence, {}, {}});
    }
  }

  /// Weights times visibility.
  void see_through() {
    float nearest = candidates_[0].order, farthest = nearest, all = 0;
    for (const Candidate& c : candidates_) {
      nearest = std::min(nearest, c.order);
      farthest = std::max(farthest, c.order);
      all += c.weight;
    }
    if (farthest <= nearest * (1 + kSame)) return;
    weights_.clear();
    for (const Candidate& c : candidates_) {
      float in_front = 0, beside = 0;
      for (const Candidate& other : candidates_) {
        const float apart = smooth_step(kSame, kInFront, std::max(c.order / other.order, other.order / c.order) - 1);
        beside += other.weight * (1 - apart);
        if (other.order < c.order) in_front += other.weight * apart;
      }
      weights_.push_back(c.weight * smooth_step(kError * all, kSurface * all, beside) *
                         (1 - smooth_step(kError * all, kSurface * all, in_front)));
    }
    for (std::size_t k = 0; k < candidates_.size(); ++k) candidates_[k].weight = weights_[k];
  }

  void sample(int y, int x) {
    float all = 0;
    for (const Candidate& c : candidates_) all += c.weight;
    for (Candidate& c : candidates_) c.weight -= kNegligible * all;
    std::erase_if(candidates_, [](const Candidate& c) { return c.weight <= 0; });
    for (Candidate& c : candidates_) {
      c.bgr = resample(layers_[c.layer].bgr, layers_[c.layer].layer.source_px(y, x));
      for (int k = 0; k < 3; ++k) c.root[k] = std::sqrt(std::max(0.0F, c.bgr[k]));
    }
  }

  /// Weights times the share of the weight that shows the same colour.
  void agree() {
    weights_.clear();
    float all = 0;
    for (const Candidate& c : candidates_) {
      all += c.weight;
      weights_.push_back(c.weight);  // of what agrees with it: itself to begin with
    }
    for (std::size_t i = 0; i < candidates_.size(); ++i)
      for (std::size_t k = i + 1; k < candidates_.size(); ++k) {
        const float alike = likeness(candidates_[i].root, candidates_[k].root);
        weights_[i] += alike * candidates_[k].weight;
        weights_[k] += alike * candidates_[i].weight;
      }
    for (std::size_t k = 0; k < candidates_.size(); ++k) candidates_[k].weight *= weights_[k] / all;
  }

  void write(int y, int x, ViewPicture& picture) const {
    cv::Vec3f sum(0, 0, 0), paint(0, 0, 0);
    float all = 0, z = 0, guessed = 0, alpha = 0;
    const Candidate* strongest = &candidates_.front();
    for (const Candidate& c : candidates_) {
      sum += c.weight * c.bgr;
      paint += c.weight * layers_[c.layer].paint;
      z += c.weight * c.z;
      alpha += c.weight * alpha_at(layers_[c.layer].alpha, layers_[c.layer].layer.source_px(y, x));
      guessed += c.confidence <= kGuess ? c.weight : 0;
      all += c.weight;
      if (c.weight > strongest->weight) strongest = &c;
    }
    picture.strongest(y, x) = static_cast<uchar>(strongest->layer);
    for (int k = 0; k < 3; ++k) picture.bgr(y, x)[k] = std::max(0.0F, sum[k] / all);
    picture.z(y, x) = z / all;
    picture.alpha(y, x) = alpha / all;
    for (int k = 0; k < 3; ++k) picture.paint(y, x)[k] = static_cast<uchar>(paint[k] / all);
    picture.hole(y, x) = guessed / all;
  }

  const std::vector<PictureLayer>& layers_;
  std::vector<Candidate> candidates_;
  std::vector<float> weights_;
};

}  // namespace

ViewPicture blend(const std::vector<PictureLayer>& layers) {
  check(layers.size() < kNoLayer, "a view is drawn from fewer than 255 images");
  const cv::Size size = layers.front().layer.z.size();
  ViewPicture picture{
      cv::Mat3f(size, cv::Vec3f(0, 0, 0)), cv::Mat1f(size, 0.0F),    cv::Mat1f(size, 0.0F), cv::Mat1f(size, 1.0F),
      cv::Mat3b(size, cv::Vec3b(0, 0, 0)), cv::Mat1b(size, kNoLayer)};
  cv::parallel_for_(cv::Range(0, size.height), [&](const cv::Range& rows) {
    Mixer mixer(layers);
    for (int y = rows.start; y < rows.end; ++y)
      for (int x = 0; x < size.width; ++x) mixer.mix(y, x, picture);
  });
  return picture;
}

}  // namespace vantage
