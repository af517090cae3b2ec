#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace vantage {

/// Presentation times of a camera's frames, first one 0, strictly rising.
struct TimeStamps {
  double fps = 0;  ///< nominal
  std::vector<double> pts_s;
  int num_guessed = 0;  ///< frames whose time nothing told: one nominal interval after the one before
};

/// Presentation times that a video file's packets carry, rising, first one 0; empty when it carries none.
/// scratch: a folder for a temporary file.
std::vector<double> packet_times_s(const std::filesystem::path& video, const std::filesystem::path& scratch);

/// One time per decoded frame. When the packets are as many as the frames their times are the truth. Otherwise (the
/// footage is damaged) decoder_s is, which is wrong for the last few frames: OpenCV 4.6 says 0 for what the decoder
/// held back, and is off by the decoding delay for the first one.
TimeStamps time_stamps(std::span<const double> decoder_s, std::span<const double> packets_s, double nominal_fps);

/// Whether all intervals are the same but for rounding to milliseconds.
bool has_constant_rate(std::span<const double> pts_s);

/// Applies a frame rate that a person has declared: frame k of footage with a constant rate is then at k / fps. With a
/// variable rate the footage's time stamps stay. Returns a sentence when the two disagree, else nothing.
std::string declare_fps(TimeStamps& times, double declared_fps);

}  // namespace vantage
