#pragma once
#include <filesystem>
#include <optional>
#include <vector>

namespace vantage::sync {

/// audio.json of an ingest artifact: loudness (root mean square) of rate_hz windows a second, from the first frame on.
struct Envelope {
  double rate_hz = 0;
  std::vector<double> rms;
};
/// Empty when the footage has no sound.
std::optional<Envelope> read_envelope(const std::filesystem::path& ingest_artifact);

struct AudioOffset {
  double offset_s = 0;     ///< t_a = offset_s + t_b
  double std_s = 0;        ///< one window: sound also needs 2.9 ms per metre, which nobody told us
  double correlation = 0;  ///< at the best lag, -1 to 1
  double contrast = 0;     ///< over the best lag a quarter second or more away; at least 1
};

/// Normalised cross-correlation of two envelopes, with a parabola through the peak. Lags within ±max_offset_s at which
/// they share at least two seconds or 40 % of the shorter one. Empty when there are none or an envelope is constant.
std::optional<AudioOffset> correlate_envelopes(const Envelope& a, const Envelope& b, double max_offset_s);

}  // namespace vantage::sync
