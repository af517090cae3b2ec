#include "schema/formats/shutter.h"

#include "schema/base/json.h"

namespace vantage {

double row_delay_s(double y_px, int height_px, double readout_s) { return readout_s * (y_px / height_px - 0.5); }

std::optional<PairShutter> read_pair_shutter(const std::filesystem::path& sync_artifact) {
  const auto file = sync_artifact / "shutter.json";
  if (!std::filesystem::exists(file)) return std::nullopt;
  const Json json = read_json(file);
  PairShutter out{.a = json.at("a"), .b = json.at("b")};
  for (int i = 0; i < 3; ++i) {
    out.g[i] = json.at("g").at(static_cast<std::size_t>(i));
    for (int j = 0; j < 3; ++j)
      out.H(i, j) = json.at("H").at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(j));
  }
  return out;
}

void write_pair_shutter(const std::filesystem::path& file, const PairShutter& s) {
  Json H = Json::array();
  for (int i = 0; i < 3; ++i) H.push_back({s.H(i, 0), s.H(i, 1), s.H(i, 2)});
  write_json(file, {{"a", s.a}, {"b", s.b}, {"H", H}, {"g", {s.g[0], s.g[1], s.g[2]}}});
}

}  // namespace vantage
