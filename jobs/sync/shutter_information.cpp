#include "jobs/sync/shutter_information.h"

#include <cmath>

namespace vantage::sync {
namespace {

constexpr double kRunS = 2;
constexpr std::size_t kMinRunSamples = 4;
constexpr double kLossScale = 2;

struct Rows {
  std::vector<Eigen::Vector3d> J;
  std::vector<double> r;
};

void add_sample(Rows& rows, const ShutterInput& in, const PathPair& pair, std::size_t k) {
  const double time_b_s = (pair.a.time_s(k) - in.clock.offset_s) / in.clock.rate;
  const auto here = in.residual(pair, k, time_b_s), before = in.residual(pair, k, time_b_s - in.frame_b_s),
             after = in.residual(pair, k, time_b_s + in.frame_b_s);
  if (!here || !before || !after) return;
  const double slope = (*after - *before) / (2 * in.frame_b_s);
  const double row_a = pair.a.px(k).y() / in.height_a_px - 0.5, row_b = pair.b.at(time_b_s)->y() / in.height_b_px - 0.5;
  rows.J.push_back(slope * Eigen::Vector3d(1, -row_a, row_b));
  rows.r.push_back(*here);
}

/// (σ² I + σ_b² 1 1ᵀ)^-1 by Sherman and Morrison.
void add_run(PairShutter& out, const Rows& rows, const OffsetFit& clock) {
  const auto n = static_cast<double>(rows.r.size());
  const double s2 = clock.noise_px * clock.noise_px, b2 = clock.bias_px * clock.bias_px, shrink = b2 / (s2 + n * b2);
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero(), sum_J = Eigen::Vector3d::Zero();
  double chi2 = 0, sum_r = 0;
  for (std::size_t k = 0; k < rows.r.size(); ++k) {
    H += rows.J[k] * rows.J[k].transpose();
    g += rows.J[k] * rows.r[k];
    chi2 += rows.r[k] * rows.r[k];
    sum_J += rows.J[k];
    sum_r += rows.r[k];
  }
  const double weight = 1 / (1 + (chi2 - shrink * sum_r * sum_r) / s2 / n / (kLossScale * kLossScale));
  out.H += weight / s2 * (H - shrink * sum_J * sum_J.transpose());
  out.g += weight / s2 * (g - shrink * sum_J * sum_r);
}

}  // namespace

PairShutter shutter_information(const ShutterInput& in) {
  PairShutter out;
  for (const PathPair& pair : in.pairs)
    for (std::size_t first = 0; first < pair.a.size();) {
      Rows rows;
      std::size_t k = first;
      for (; k < pair.a.size() && pair.a.time_s(k) - pair.a.time_s(first) <= kRunS; ++k) add_sample(rows, in, pair, k);
      if (rows.r.size() >= kMinRunSamples) add_run(out, rows, in.clock);
      first = k;
    }
  return out;
}

}  // namespace vantage::sync
