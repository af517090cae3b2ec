#include "jobs/views/disparity_curve.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "jobs/views/monotone_cubic.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// Of the scene's disparities, this share at either end may lie in front of or behind the budget before it is mapped:
/// depth that is wrong must not press all the rest together. The map holds them at the budget's end.
constexpr double kTail = 0.001;
constexpr double kMaxWidening = 4;

struct Span {
  double low, high;
  double width() const { return high - low; }
  double middle() const { return 0.5 * (low + high); }
};

Span budget_px(const DisparityMapping& m) {
  return {-m.budget.uncrossed_percent / 100 * m.width_px, m.budget.crossed_percent / 100 * m.width_px};
}

Span scene_px(const DisparityHistogram& scene) { return {scene.quantile(kTail), scene.quantile(1 - kTail)}; }

/// The part of the budget that a scene is brought onto: all of it, less where that would widen the scene too much.
Span target_px(const Span& budget, const Span& scene) {
  const double half = 0.5 * std::min(budget.width(), kMaxWidening * scene.width());
  const double middle = std::clamp(scene.middle(), budget.low + half, budget.high - half);
  return {middle - half, middle + half};
}

/// from ↦ to at both ends, `rise` (0 to 1, of the way between) in between.
template <class Rise>
DisparityCurve onto(const DisparityMapping& m, const Span& from, const Span& to, Rise&& rise) {
  return DisparityCurve::sampled(m.width_px, [&](double d) {
    const double way = from.width() > 0 ? std::clamp((d - from.low) / from.width(), 0.0, 1.0) : 0.5;
    return to.low + to.width() * rise(way);
  });
}

/// k of log(1 + k d) / k = limit at d = extreme > limit > 0: it falls with k, from extreme to 0.
double log_steepness(double extreme, double limit) {
  double low = 0, high = 1;
  while (std::log1p(high * extreme) / high > limit) high *= 2;
  for (int step = 0; step < 60; ++step) {
    const double k = 0.5 * (low + high);
    (std::log1p(k * extreme) / k > limit ? low : high) = k;
  }
  return high;
}

/// One side of the screen, as a function of the distance from it.
class LogSide {
 public:
  LogSide(double extreme, double limit)
      : limit_(limit), steepness_(limit > 0 && extreme > limit ? log_steepness(extreme, limit) : 0) {}
  double operator()(double distance) const {
    return std::min(limit_, steepness_ > 0 ? std::log1p(steepness_ * distance) / steepness_ : distance);
  }

 private:
  double limit_, steepness_;
};

DisparityCurve log_curve(const DisparityMapping& m, const DisparityHistogram& scene) {
  const Span from = scene_px(scene), to = budget_px(m);
  const LogSide in_front(from.high, to.high), behind(-from.low, -to.low);
  return DisparityCurve::sampled(m.width_px, [&](double d) { return d > 0 ? in_front(d) : -behind(-d); });
}

/// What each of the equal parts of the scene's range gets of the budget (sum 1): by how much of the picture lies in it,
/// a part at most 4 times its even share; what is cut off goes to all alike.
constexpr std::size_t kNumParts = 16;
constexpr double kMaxShare = 4.0 / kNumParts;
std::array<double, kNumParts> part_shares(const DisparityHistogram& scene, const Span& from, double strength) {
  std::array<double, kNumParts> shares{};
  double sum = 0;
  for (std::size_t k = 0; k < kNumParts; ++k) {
    const auto edge = [&](std::size_t at) { return from.low + from.width() * static_cast<double>(at) / kNumParts; };
    shares[k] = std::min(kMaxShare, scene.share_below(edge(k + 1)) - scene.share_below(edge(k)));
    sum += shares[k];
  }
  for (double& share : shares) share = strength * (share + (1 - sum) / kNumParts) + (1 - strength) / kNumParts;
  return shares;
}

DisparityCurve histogram_curve(const DisparityMapping& m, const DisparityHistogram& scene) {
  const Span from = scene_px(scene);
  std::vector<double> ways{0.0}, rises{0.0};
  for (const double share : part_shares(scene, from, m.strength)) {
    ways.push_back(static_cast<double>(ways.size()) / kNumParts);
    rises.push_back(rises.back() + share);
  }
  const MonotoneCubic rise(std::move(ways), std::move(rises));
  return onto(m, from, target_px(budget_px(m), from), [&](double way) { return std::clamp(rise(way), 0.0, 1.0); });
}

DisparityCurve piecewise_curve(const DisparityMapping& m) {
  std::vector<double> before, after;
  for (const auto& [d, mapped] : m.points_percent) {
    before.push_back(d / 100 * m.width_px);
    after.push_back(mapped / 100 * m.width_px);
  }
  const MonotoneCubic curve(std::move(before), std::move(after));
  return DisparityCurve::sampled(m.width_px, curve);
}

}  // namespace

DisparityCurve DisparityCurve::line(double gain, double offset_px) {
  DisparityCurve c;
  c.out_px_ = {offset_px, offset_px + gain};
  c.slope_beyond_ = gain;
  return c;
}

DisparityCurve DisparityCurve::mean(const DisparityCurve& a, const DisparityCurve& b, double w) {
  check(a.out_px_.size() == b.out_px_.size() && a.per_px_ == b.per_px_, "curves to be averaged share their cells");
  DisparityCurve c = a;
  c.slope_beyond_ = (1 - w) * a.slope_beyond_ + w * b.slope_beyond_;
  for (std::size_t k = 0; k < c.out_px_.size(); ++k) c.out_px_[k] = (1 - w) * a.out_px_[k] + w * b.out_px_[k];
  return c;
}

DisparityCurve disparity_curve(const DisparityMapping& m, const DisparityHistogram& scene) {
  if (m.kind == "linear") return DisparityCurve::line(m.gain, m.offset_px);
  if (m.kind == "piecewise") return piecewise_curve(m);
  if (scene.empty()) {
    const Span budget = budget_px(m);
    return DisparityCurve::sampled(m.width_px, [&](double d) { return std::clamp(d, budget.low, budget.high); });
  }
  if (m.kind == "log") return log_curve(m, scene);
  if (m.kind == "histogram") return histogram_curve(m, scene);
  check(m.kind == "fit", "a disparity map is of a known kind: " + m.kind);
  const Span from = scene_px(scene);
  return onto(m, from, target_px(budget_px(m), from), [](double way) { return way; });
}

Json to_json(const DisparityMapping& m) {
  return {{"kind", m.kind},
          {"width_px", m.width_px},
          {"gain", m.gain},
          {"offset_px", m.offset_px},
          {"points_percent", m.points_percent},
          {"strength", m.strength},
          {"crossed_percent", m.budget.crossed_percent},
          {"uncrossed_percent", m.budget.uncrossed_percent}};
}

DisparityMapping disparity_mapping_from(const Json& j) {
  return {j.at("kind"),
          j.at("width_px"),
          j.at("gain"),
          j.at("offset_px"),
          j.at("points_percent"),
          j.at("strength"),
          {j.at("crossed_percent"), j.at("uncrossed_percent")}};
}

}  // namespace vantage
