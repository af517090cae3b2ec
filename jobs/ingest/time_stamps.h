#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace vantage {

/// Presentation times of a camera's frames, first one 0, strictly rising.
struct TimeStamps {
  double fps = 0;  ///< nominal
  std::vector<double> pts_s;
  int num_guessed = 0;  ///< frames without a time stamp of their own, or with one that does not rise
};

/// Presentation times that a video file's packets carry, rising, first one 0; empty when it carries none.
/// scratch: a folder for a temporary file.
std::vector<double> packet_times_s(const std::filesystem::path& video, const std::filesystem::path& scratch);

/// told_s: what the file says of each decoded frame, in order of presentation. Stamps that do not fit a rising order
/// (twice the same, a jump back) are dropped, as few as possible; frames without one lie evenly between their
/// neighbours, before the first and behind the last at the nominal rate. declared_fps is the nominal rate unless the
/// stamps' median interval is more than 5 % off.
TimeStamps time_stamps(std::span<const std::optional<double>> told_s, double declared_fps);

/// "no picture from 1.2 s to 3.4 s (after frame 30)" for intervals four times the median and 0.2 s at least: the
/// footage has a gap there.
std::vector<std::string> gaps_in(std::span<const double> pts_s);

/// Whether all intervals are the same but for rounding to milliseconds.
bool has_constant_rate(std::span<const double> pts_s);

/// Applies a frame rate that a person has declared: frame k of footage with a constant rate is then at k / fps. With a
/// variable rate the footage's time stamps stay. Returns a sentence when the two disagree, else nothing.
std::string declare_fps(TimeStamps& times, double declared_fps);

}  // namespace vantage
