#include "jobs/sync/evidence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace vantage::sync {
namespace {

constexpr double kMaxDeviations = 4;
/// Cues that look at different parts of a thing differ by systematic errors, too.
constexpr double kFloorFrames = 0.1;

double at_pivot(const OffsetFit& fit, double pivot_b_s) { return fit.offset_s + fit.rate * pivot_b_s; }

/// Inverse variance mean of offset and rate, less certain by as much as the two differ by more than they say (Birge's
/// ratio); pivots of the two lie near each other, in the middle of the overlap.
OffsetFit mean_of(const OffsetFit& p, const OffsetFit& q) {
  const double wp = 1 / (p.std_s * p.std_s), wq = 1 / (q.std_s * q.std_s);
  OffsetFit out = wp >= wq ? p : q;
  out.pivot_b_s = (wp * p.pivot_b_s + wq * q.pivot_b_s) / (wp + wq);
  const double offset = (wp * at_pivot(p, out.pivot_b_s) + wq * at_pivot(q, out.pivot_b_s)) / (wp + wq);
  if (p.rate_std > 0 && q.rate_std > 0) {
    const double rp = 1 / (p.rate_std * p.rate_std), rq = 1 / (q.rate_std * q.rate_std);
    out.rate = (rp * p.rate + rq * q.rate) / (rp + rq);
    out.rate_std = 1 / std::sqrt(rp + rq);
  }
  out.offset_s = offset - out.rate * out.pivot_b_s;
  const double apart_s = at_pivot(p, out.pivot_b_s) - at_pivot(q, out.pivot_b_s);
  out.std_s = std::max(1.0, std::abs(apart_s) / std::hypot(p.std_s, q.std_s)) / std::sqrt(wp + wq);
  out.num_tracks = p.num_tracks + q.num_tracks;
  out.effective_tracks = p.effective_tracks + q.effective_tracks;
  return out;
}

Combined alone(const Evidence& e) { return {e.fit, e.contrast, e.min_tracks, e.cue, ""}; }

}  // namespace

Combined combine(const Evidence& p, const Evidence& q, double frame_s, double min_contrast) {
  if (!p.fit || !q.fit) return alone(p.fit ? p : q);
  const double pivot = 0.5 * (p.fit->pivot_b_s + q.fit->pivot_b_s);
  const double apart = std::abs(at_pivot(*p.fit, pivot) - at_pivot(*q.fit, pivot));
  const double tolerance = kMaxDeviations * std::hypot(p.fit->std_s, q.fit->std_s, kFloorFrames * frame_s);
  if (apart <= std::min(tolerance, frame_s))
    return {mean_of(*p.fit, *q.fit), std::max(1.0, p.contrast) * std::max(1.0, q.contrast),
            std::min(p.min_tracks, q.min_tracks), p.cue + " and " + q.cue, ""};
  const bool p_sure = p.contrast >= min_contrast, q_sure = q.contrast >= min_contrast;
  Combined out = alone(p_sure != q_sure ? (p_sure ? p : q) : (p.contrast >= q.contrast ? p : q));
  if (p_sure && q_sure)
    out.disagreement =
        fmt::format("{} say {:+.3f} s, {} say {:+.3f} s", p.cue, p.fit->offset_s, q.cue, q.fit->offset_s);
  return out;
}

}  // namespace vantage::sync
