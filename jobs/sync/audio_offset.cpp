#include "jobs/sync/audio_offset.h"

#include <algorithm>
#include <cmath>

#include "schema/base/json.h"

namespace vantage::sync {
namespace {

/// Linear interpolation to another rate.
std::vector<double> resampled(const Envelope& envelope, double rate_hz) {
  if (envelope.rms.empty()) return {};
  const auto num =
      static_cast<std::size_t>(static_cast<double>(envelope.rms.size() - 1) * rate_hz / envelope.rate_hz) + 1;
  std::vector<double> out(num);
  for (std::size_t k = 0; k < num; ++k) {
    const double at = static_cast<double>(k) * envelope.rate_hz / rate_hz;
    const auto before = std::min(static_cast<std::size_t>(at), envelope.rms.size() - 1);
    const double next = envelope.rms[std::min(before + 1, envelope.rms.size() - 1)];
    out[k] = envelope.rms[before] + (at - static_cast<double>(before)) * (next - envelope.rms[before]);
  }
  return out;
}

/// Pearson's correlation of a[k + lag] and b[k] over the overlap; 0 when one of them is constant there.
double correlation_at(const std::vector<double>& a, const std::vector<double>& b, std::ptrdiff_t lag) {
  const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, -lag), last = std::min(std::ssize(b), std::ssize(a) - lag);
  const auto n = static_cast<double>(last - first);
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (std::ptrdiff_t k = first; k < last; ++k) {
    const double x = a[static_cast<std::size_t>(k + lag)], y = b[static_cast<std::size_t>(k)];
    sa += x, sb += y, saa += x * x, sbb += y * y, sab += x * y;
  }
  const double va = saa - sa * sa / n, vb = sbb - sb * sb / n;
  const double tiny = 1e-12 * (saa + sbb);
  return va > tiny && vb > tiny ? (sab - sa * sb / n) / std::sqrt(va * vb) : 0;
}

}  // namespace

std::optional<Envelope> read_envelope(const std::filesystem::path& ingest_artifact) {
  const auto file = ingest_artifact / "audio.json";
  if (!std::filesystem::exists(file)) return std::nullopt;
  const Json json = read_json(file);
  return Envelope{json.at("rate_hz"), json.at("rms").get<std::vector<double>>()};
}

std::optional<AudioOffset> correlate_envelopes(const Envelope& a, const Envelope& b, double max_offset_s) {
  const double rate_hz = std::max(a.rate_hz, b.rate_hz);
  const std::vector<double> x = resampled(a, rate_hz), y = resampled(b, rate_hz);
  const double shorter = static_cast<double>(std::min(x.size(), y.size()));
  const auto overlap = static_cast<std::ptrdiff_t>(std::min(2 * rate_hz, 0.4 * shorter));
  const auto limit = static_cast<std::ptrdiff_t>(max_offset_s * rate_hz);
  const std::ptrdiff_t first = std::max(-limit, overlap - std::ssize(y)),
                       last = std::min(limit, std::ssize(x) - overlap);
  if (overlap < 3 || last < first) return std::nullopt;
  std::vector<double> correlations;
  for (std::ptrdiff_t lag = first; lag <= last; ++lag) correlations.push_back(correlation_at(x, y, lag));
  const std::ptrdiff_t best = std::max_element(correlations.begin(), correlations.end()) - correlations.begin();
  const auto at = [&](std::ptrdiff_t k) { return correlations[static_cast<std::size_t>(k)]; };
  if (at(best) <= 0) return std::nullopt;

  double second = 1e-6, shift = 0;
  for (std::ptrdiff_t k = 0; k < std::ssize(correlations); ++k)
    if (std::abs(static_cast<double>(k - best)) >= 0.25 * rate_hz) second = std::max(second, at(k));
  if (best > 0 && best + 1 < std::ssize(correlations)) {
    const double curvature = at(best - 1) - 2 * at(best) + at(best + 1);
    if (curvature < 0) shift = 0.5 * (at(best - 1) - at(best + 1)) / curvature;
  }
  return AudioOffset{(static_cast<double>(first + best) + shift) / rate_hz, 1 / std::min(a.rate_hz, b.rate_hz),
                     at(best), std::max(1.0, at(best) / second)};
}

}  // namespace vantage::sync
