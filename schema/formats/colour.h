#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vantage {

/// How a camera's colours come to the look that all cameras of a shot share. In linear light (IEC 61966-2-1) per
/// channel: L_shared = gain · 0.18 · (L / 0.18)^gamma, so that gain is what happens at mid grey.
struct CameraColour {
  std::string name;
  std::array<double, 3> gain{1, 1, 1};  ///< red, green, blue
  double gamma = 1;
};
constexpr double kMidGrey = 0.18;

/// Linear light, 0–1, of an 8-bit sRGB level, 0–255, and back (not rounded, clamped).
double linear_of_level(double level);
double level_of_linear(double linear);

/// What becomes of each 8-bit level of a channel (0 red, 1 green, 2 blue).
std::array<std::uint8_t, 256> level_table(const CameraColour& colour, int channel);

/// colour.json of a calibrate artifact. Empty when there is none: the cameras agree, pictures stay as they are.
std::vector<CameraColour> read_colours(const std::filesystem::path& calibrate_artifact);
void write_colours(const std::filesystem::path& file, const std::vector<CameraColour>& colours);

}  // namespace vantage
