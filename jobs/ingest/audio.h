#pragma once
#include <filesystem>
#include <vector>

namespace vantage {

constexpr double kEnvelopeRateHz = 100;

/// Loudness (RMS, 1 = full scale) of a video's first sound track, all channels mixed, 100 values a second; value k
/// covers k/100 s to (k+1)/100 s after first_picture_s, which is on the file's clock. Empty when there is no sound.
/// scratch: a folder for temporary files.
std::vector<double> audio_envelope(const std::filesystem::path& video, double first_picture_s,
                                   const std::filesystem::path& scratch);

}  // namespace vantage
