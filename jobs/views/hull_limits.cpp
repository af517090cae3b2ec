#include "jobs/views/hull_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "jobs/views/key_frames.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// "-12.0 to 8.5"
template <class Value>
std::string range_of(const Navspace& navspace, int decimals, const Value& value) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const NavVertex& v : navspace.vertices) {
    low = std::min(low, value(v));
    high = std::max(high, value(v));
  }
  return fmt::format("{:.{}f} to {:.{}f}", low, decimals, high, decimals);
}

/// A path's views have been moved to the hull already.
NavPoint asked_for(const RenderRequest& request, const VirtualView& view) {
  if (request.keyframes.empty()) return view.nav;
  const KeyFrame key = path_at(request.keyframes, view.frame / request.fps);
  return {key.azimuth_deg, key.elevation_deg, key.time_s};
}

}  // namespace

void refuse_outside(const RenderRequest& request, const VirtualView& view, const Navspace& navspace) {
  const bool outside = view.location.outside || std::any_of(view.eyes.begin(), view.eyes.end(),
                                                            [](const auto& eye) { return eye.location.outside; });
  if (!outside) return;
  const NavPoint p = asked_for(request, view);
  throw Error(
      ErrorKind::BadInput,
      fmt::format("{}:{}: render '{}' frame {}: azimuth {:.1f}°, elevation {:.1f}°, time {:.3f} s lies outside the "
                  "recording hull (azimuth {}°, elevation {}°, time {} s); move the path inside, or set outside = "
                  "\"clamp\" to draw it from the nearest images",
                  request.options.file, request.line, request.name, view.frame, p.azimuth_deg, p.elevation_deg,
                  p.time_s, range_of(navspace, 1, [](const NavVertex& v) { return v.azimuth_deg; }),
                  range_of(navspace, 1, [](const NavVertex& v) { return v.elevation_deg; }),
                  range_of(navspace, 3, [](const NavVertex& v) { return v.time_s; })));
}

}  // namespace vantage
