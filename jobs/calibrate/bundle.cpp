#include "jobs/calibrate/bundle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "jobs/calibrate/bundle_problem.h"
#include "jobs/vision/undistort.h"

namespace vantage {
namespace {

constexpr int kRounds = 3;
constexpr double kFarSigmas = 5;
constexpr double kLeastNoisePx = 0.1;  // SIFT's own rounding; of drawn measurements without noise

void solve(SparseModel& model, const LensFreedom& freedom, double noise_px) {
  BundleProblem bundle(model, freedom, noise_px);
  bundle.hold_the_world();
  bundle.solve();
}

/// Number of observations dropped.
int drop_outliers(SparseModel& model, double max_error_px) {
  const auto before = model.observations.size();
  std::erase_if(model.observations, [&](const auto& o) { return error_px(model, o) > max_error_px; });
  std::vector<int> times_seen(model.points.size());
  for (const auto& o : model.observations) ++times_seen[static_cast<std::size_t>(o.point)];
  std::erase_if(model.observations, [&](const auto& o) { return times_seen[static_cast<std::size_t>(o.point)] < 2; });
  return static_cast<int>(before - model.observations.size());
}

/// Points that nothing sees any more go; indices follow.
void drop_unseen_points(SparseModel& model) {
  std::vector<int> new_index(model.points.size(), -1);
  for (const auto& o : model.observations) new_index[static_cast<std::size_t>(o.point)] = 0;
  std::vector<SparseModel::Point> kept;
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    if (new_index[i] < 0) continue;
    new_index[i] = static_cast<int>(kept.size());
    kept.push_back(model.points[i]);
  }
  for (auto& o : model.observations) o.point = new_index[static_cast<std::size_t>(o.point)];
  model.points = std::move(kept);
}

BundleReport report_of(const SparseModel& model, const LensFreedom& lens, int num_dropped) {
  BundleReport out{
      .num_observations = static_cast<int>(model.observations.size()), .num_dropped = num_dropped, .lens = lens};
  for (const auto& o : model.observations) {
    const double e = error_px(model, o);
    out.mean_px += e;
    out.rms_px += e * e;
  }
  const double n = std::max(1, out.num_observations);
  out.mean_px /= n;
  out.rms_px = std::sqrt(out.rms_px / n);
  return out;
}

}  // namespace

double error_px(const SparseModel& model, const SparseModel::Observation& o) {
  const Eigen::Vector3d p = model.cam_from_world.at(o.image) * model.points[static_cast<std::size_t>(o.point)].position;
  if (!(p.z() > 0)) return std::numeric_limits<double>::infinity();
  const cv::Point2d px = distort(model.lenses.at(o.image.camera), {p.x() / p.z(), p.y() / p.z()});
  return std::hypot(px.x - o.px.x(), px.y - o.px.y());
}

double noise_px(const SparseModel& model) {
  std::vector<double> errors;
  for (const auto& o : model.observations) errors.push_back(error_px(model, o));
  if (errors.empty()) return kLeastNoisePx;
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return std::max(kLeastNoisePx, *middle / std::sqrt(2 * std::log(2.0)));  // median of Rayleigh's distribution
}

BundleReport refine_bundle(SparseModel& model, const BundleOptions& options) {
  int num_dropped = 0;
  double noise = 0.5;  // a good feature's, before anything is known
  for (int round = 0; round < kRounds; ++round) {
    solve(model, options.lens, noise);
    noise = noise_px(model);
    num_dropped += drop_outliers(model, std::min(options.max_error_px, kFarSigmas * noise));
    drop_unseen_points(model);
  }
  solve(model, options.lens, noise);
  return report_of(model, options.lens, num_dropped);
}

}  // namespace vantage
