#include "schema/formats/colour.h"

#include <algorithm>
#include <cmath>

#include "schema/base/json.h"

namespace vantage {

double linear_of_level(double level) {
  const double v = level / 255;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

double level_of_linear(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  return 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055);
}

std::array<std::uint8_t, 256> level_table(const CameraColour& colour, int channel) {
  const double gain = colour.gain.at(static_cast<std::size_t>(channel));
  std::array<std::uint8_t, 256> table{};
  for (std::size_t level = 0; level < table.size(); ++level) {
    const double linear = linear_of_level(static_cast<double>(level));
    const double shared = gain * kMidGrey * std::pow(linear / kMidGrey, colour.gamma);
    table[level] = static_cast<std::uint8_t>(std::lround(level_of_linear(shared)));
  }
  return table;
}

std::vector<CameraColour> read_colours(const std::filesystem::path& calibrate_artifact) {
  const std::filesystem::path file = calibrate_artifact / "colour.json";
  std::vector<CameraColour> colours;
  if (!std::filesystem::exists(file)) return colours;
  const Json all = read_json(file);
  for (const Json& j : all.at("cameras"))
    colours.push_back({.name = j.at("name"), .gain = j.at("gain"), .gamma = j.at("gamma")});
  return colours;
}

void write_colours(const std::filesystem::path& file, const std::vector<CameraColour>& colours) {
  Json list = Json::array();
  for (const auto& c : colours) list.push_back({{"name", c.name}, {"gain", c.gain}, {"gamma", c.gamma}});
  write_json(file, {{"mid_grey", kMidGrey}, {"cameras", list}});
}

}  // namespace vantage
