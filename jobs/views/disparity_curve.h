#pragma once
/// What becomes of disparity on its way to the screen: the operators of Lang et al., "Nonlinear disparity mapping for
/// stereoscopic 3D" (SIGGRAPH 2010, §3), applied to depth directly.
/// Disparity here is x in the left eye less x in the right eye, in pixels of the picture: positive lies in front of the
/// screen (crossed), negative behind it (uncrossed).
#include <string>
#include <vector>

#include "jobs/views/disparity_histogram.h"
#include "schema/base/json.h"

namespace vantage {

/// How far things may leave the screen, in % of the picture's width.
struct DepthBudget {
  double crossed_percent = 1, uncrossed_percent = 2;  ///< in front and behind; both ≥ 0
};

/// A curve that never falls, as a table: quick, and the same on every machine.
class DisparityCurve {
 public:
  /// d ↦ gain · d + offset_px.
  static DisparityCurve line(double gain, double offset_px);
  /// curve sampled over ± half a picture's width, constant beyond.
  template <class Curve>
  static DisparityCurve sampled(double width_px, Curve&& curve);
  /// (1 - w) · a + w · b, both sampled() for one width, or lines.
  static DisparityCurve mean(const DisparityCurve& a, const DisparityCurve& b, double w);

  double operator()(double disparity_px) const {
    const double t = (disparity_px - first_px_) * per_px_;
    const double last = static_cast<double>(out_px_.size() - 1);
    if (!(t > 0)) return out_px_.front() + slope_beyond_ * t;
    if (t >= last) return out_px_.back() + slope_beyond_ * (t - last);
    const auto k = static_cast<std::size_t>(t);
    return out_px_[k] + (t - static_cast<double>(k)) * (out_px_[k + 1] - out_px_[k]);
  }

 private:
  double first_px_ = 0, per_px_ = 1;      ///< place of out_px_[0], entries a pixel
  double slope_beyond_ = 1;               ///< per entry
  std::vector<double> out_px_{0.0, 1.0};  ///< as it is: disparity that nobody changes
};

/// How a [[render]] maps disparity.
struct DisparityMapping {
  std::string kind = "linear";  ///< "linear", "fit", "log", "piecewise", "histogram"
  double width_px = 0;          ///< of the picture; all percents are of it
  double gain = 1, offset_px = 0;
  std::vector<std::pair<double, double>> points_percent;  ///< piecewise: disparity before and after, rising
  double strength = 0.7;                                  ///< histogram: 0 a line … 1 the histogram alone
  DepthBudget budget;

  bool needs_scene() const { return kind == "fit" || kind == "log" || kind == "histogram"; }
};

/// scene: disparities that the scene has, for the kinds that need it (empty: nothing is known of it).
///   linear     gain · d + offset
///   fit        a line that brings the scene's range onto the budget
///   log        sign(d) · log(1 + k |d|) / k: natural depth at the screen, ever less away from it; k on either side
///   just
///              so that the scene stays in the budget; a side that does anyway is left alone
///   piecewise  monotone cubic through points_percent, constant beyond them
///   histogram  the scene's range onto the budget, more of it for disparities that more of the picture has
/// fit and histogram widen a shallow scene by 4 times at most. All but linear stay in the budget, piecewise in its
/// points.
DisparityCurve disparity_curve(const DisparityMapping& mapping, const DisparityHistogram& scene);

Json to_json(const DisparityMapping& mapping);
DisparityMapping disparity_mapping_from(const Json& json);

template <class Curve>
DisparityCurve DisparityCurve::sampled(double width_px, Curve&& curve) {
  constexpr int kNumCells = 2000;
  DisparityCurve c;
  c.first_px_ = -0.5 * width_px;
  c.per_px_ = kNumCells / width_px;
  c.slope_beyond_ = 0;
  c.out_px_.resize(kNumCells + 1);
  for (int k = 0; k <= kNumCells; ++k)
    c.out_px_[static_cast<std::size_t>(k)] = curve(c.first_px_ + static_cast<double>(k) / c.per_px_);
  return c;
}

}  // namespace vantage
