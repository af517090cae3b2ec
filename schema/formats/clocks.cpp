#include "schema/formats/clocks.h"

#include "schema/base/json.h"

namespace vantage {

const CameraClock* Clocks::find(const std::string& camera) const {
  for (const auto& c : cameras)
    if (c.name == camera) return &c;
  return nullptr;
}

Clocks read_clocks(const std::filesystem::path& align_artifact) {
  const Json j = read_json(align_artifact / "clocks.json");
  Clocks clocks{j.at("reference"), {}};
  for (const Json& c : j.at("cameras"))
    clocks.cameras.push_back(
        {c.at("name"), c.at("offset_s"), c.at("rate"), c.at("offset_std_s"), c.value("rate_std", 0.0)});
  return clocks;
}

void write_clocks(const std::filesystem::path& file, const Clocks& clocks) {
  Json cameras = Json::array();
  for (const auto& c : clocks.cameras)
    cameras.push_back({{"name", c.name},
                       {"offset_s", c.offset_s},
                       {"rate", c.rate},
                       {"offset_std_s", c.offset_std_s},
                       {"rate_std", c.rate_std}});
  write_json(file, {{"reference", clocks.reference}, {"cameras", cameras}});
}

PairOffset read_pair_offset(const std::filesystem::path& sync_artifact) {
  const Json j = read_json(sync_artifact / "offset.json");
  return {j.at("a"),
          j.at("b"),
          j.at("offset_s"),
          j.at("rate"),
          j.at("std_s"),
          j.at("determined"),
          j.at("method"),
          j.at("num_inliers"),
          j.at("verdict"),
          j.value("rate_std", 0.0),
          j.value("pivot_b_s", 0.0)};
}

void write_pair_offset(const std::filesystem::path& file, const PairOffset& o) {
  write_json(file, {{"a", o.a},
                    {"b", o.b},
                    {"offset_s", o.offset_s},
                    {"rate", o.rate},
                    {"std_s", o.std_s},
                    {"determined", o.determined},
                    {"method", o.method},
                    {"num_inliers", o.num_inliers},
                    {"verdict", o.verdict},
                    {"rate_std", o.rate_std},
                    {"pivot_b_s", o.pivot_b_s}});
}

}  // namespace vantage
