#include "schema/formats/matches.h"

#include "schema/base/error.h"
#include "schema/base/json.h"

namespace vantage {

void write_matches(const std::filesystem::path& file, const std::vector<SharedTrack>& matches) {
  Json rows = Json::array();
  for (const auto& m : matches)
    rows.push_back({m.a, m.b, m.first_px.x(), m.first_px.y(), m.last_px.x(), m.last_px.y()});
  write_json(file, {{"matches", rows}});
}

std::vector<SharedTrack> read_matches(const std::filesystem::path& sync_artifact) {
  const auto file = sync_artifact / "matches.json";
  const Json j = read_json(file);
  std::vector<SharedTrack> matches;
  for (const Json& row : j.at("matches")) {
    if (!row.is_array() || row.size() != 6)
      throw Error(ErrorKind::BadInput, file.string() + ": found " + row.dump() +
                                           ", expected two indices of tracks and two corrections of two numbers each");
    const auto number = [&](std::size_t k) { return row[k].get<double>(); };
    matches.push_back({row[0], row[1], Eigen::Vector2d(number(2), number(3)), Eigen::Vector2d(number(4), number(5))});
  }
  return matches;
}

}  // namespace vantage
