#include "jobs/calibrate/lens_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "jobs/calibrate/bundle_problem.h"
#include "jobs/vision/undistort.h"

namespace vantage {
namespace {

// What a free term must lower the sum of squares by, in units of the variance: chance alone gives 1, wandering features
// and what no lens model describes several.
constexpr double kPricePerTerm = 12;
constexpr std::size_t kFewestLenses = 3;  // that may turn out to be one

/// Farthest that the lens moves a pixel of the picture's rim from where a pinhole would have it.
double largest_shift_px(const LensModel& lens) {
  LensBlock b = block_of(lens);
  double largest = 0;
  for (int i = 0; i <= 16; ++i)
    for (const auto& [x, y] :
         {std::pair(i / 16.0, 0.0), std::pair(i / 16.0, 1.0), std::pair(0.0, i / 16.0), std::pair(1.0, i / 16.0)}) {
      const cv::Point2d px(x * lens.width, y * lens.height);
      const cv::Point2d seen = distort(lens, {(px.x - b[kCx]) / b[kF], (px.y - b[kCy]) / (b[kF] * b[kAspect])});
      largest = std::max(largest, std::hypot(seen.x - px.x, seen.y - px.y));
    }
  return largest;
}

bool may_be_one_lens(const SparseModel& model) {
  const LensModel& first = model.lenses.begin()->second;
  return model.lenses.size() >= kFewestLenses &&
         std::all_of(model.lenses.begin(), model.lenses.end(), [&](const auto& l) {
           return l.second.width == first.width && l.second.height == first.height && l.second.model == first.model;
         });
}

/// All start from the median focal length.
void make_lenses_equal(SparseModel& model) {
  std::vector<LensModel> lenses;
  for (const auto& [name, lens] : model.lenses) lenses.push_back(lens);
  const auto middle = lenses.begin() + static_cast<std::ptrdiff_t>(lenses.size() / 2);
  std::nth_element(lenses.begin(), middle, lenses.end(),
                   [](const auto& a, const auto& b) { return a.params[0] < b.params[0]; });
  for (auto& [name, lens] : model.lenses) lens = *middle;
}

/// Sum of the squared errors of one set of measurements under Cauchy's loss, in units of their variance.
double cost(const SparseModel& model, double noise_px) {
  double sum = 0;
  for (const auto& o : model.observations) {
    const double e = error_px(model, o) / (2 * noise_px);
    sum += 4 * std::log1p(std::min(e * e, 1e6));
  }
  return sum;
}

LensModel as_opencv(const LensModel& lens) {
  const LensBlock b = block_of(lens);
  LensModel out{"OPENCV", lens.width, lens.height, {}};
  store(b, out);
  return out;
}

/// Lenses made ready for what they shall be solved for.
void prepare(SparseModel& model, const LensFreedom& freedom) {
  if (freedom.whole)
    for (auto& [name, lens] : model.lenses) lens = as_opencv(lens);
  if (freedom.shared) make_lenses_equal(model);
}

double num_terms(const SparseModel& model, const LensFreedom& freedom) {
  const std::map<std::string, int> own{
      {"SIMPLE_PINHOLE", 1}, {"SIMPLE_RADIAL", 2}, {"RADIAL", 3}, {"PINHOLE", 2}, {"OPENCV", 6}};
  const int each = (freedom.whole ? 6 : own.at(model.lenses.begin()->second.model)) + (freedom.centre ? 2 : 0);
  return each * (freedom.shared ? 1.0 : static_cast<double>(model.lenses.size()));
}

/// What the measurements cost with this freedom, and the freedom itself.
double price(SparseModel model, const LensFreedom& freedom, double noise_px) {
  prepare(model, freedom);
  BundleProblem bundle(model, freedom, noise_px);
  bundle.hold_the_world();
  bundle.solve();
  return cost(model, noise_px) + kPricePerTerm * num_terms(model, freedom);
}

LensFreedom cheapest_freedom(const SparseModel& model) {
  std::vector<LensFreedom> choices{{}, {.centre = true}, {.centre = true, .whole = true}};
  if (may_be_one_lens(model))
    for (const LensFreedom& freedom : std::vector(choices))
      choices.push_back({.centre = freedom.centre, .whole = freedom.whole, .shared = true});
  const double noise = noise_px(model);
  LensFreedom best;
  double least = std::numeric_limits<double>::infinity();
  for (const LensFreedom& freedom : choices) {
    const double p = price(model, freedom, noise);
    if (p < least) {
      least = p;
      best = freedom;
    }
  }
  return best;
}

}  // namespace

BundleReport drop_idle_lenses(SparseModel& model, const BundleOptions& options, const BundleReport& before) {
  SparseModel simpler = model;
  bool any = false;
  for (auto& [name, lens] : simpler.lenses) {
    if (lens.model.find("PINHOLE") != std::string::npos || largest_shift_px(lens) > 1) continue;
    const LensBlock b = block_of(lens);
    if (lens.model == "OPENCV")
      lens = {"PINHOLE", lens.width, lens.height, {b[kF], b[kF] * b[kAspect], b[kCx], b[kCy]}};
    else
      lens = {"SIMPLE_PINHOLE", lens.width, lens.height, {b[kF], b[kCx], b[kCy]}};
    any = true;
  }
  if (!any) return before;
  const BundleReport after = refine_bundle(simpler, options);
  if (after.rms_px > 1.02 * before.rms_px) return before;
  model = std::move(simpler);
  return after;
}

BundleReport choose_lenses(SparseModel& model, const BundleOptions& options) {
  BundleReport report = refine_bundle(model, options);
  BundleOptions chosen = options;
  chosen.lens = cheapest_freedom(model);
  prepare(model, chosen.lens);
  if (chosen.lens.shared || chosen.lens.centre) report = refine_bundle(model, chosen);
  return drop_idle_lenses(model, chosen, report);
}

}  // namespace vantage
