#include "schema/formats/footage_trim.h"

#include "schema/base/json.h"

namespace vantage {

FootageTrim read_footage_trim(const std::filesystem::path& ingest_artifact) {
  const std::filesystem::path file = ingest_artifact / "trim.json";
  if (!std::filesystem::exists(file)) return {};
  const Json j = read_json(file);
  return {.num_before = j.at("num_before"), .start_s = j.at("start_s")};
}

void write_footage_trim(const std::filesystem::path& file, const FootageTrim& trim) {
  write_json(file, {{"num_before", trim.num_before}, {"start_s", trim.start_s}});
}

}  // namespace vantage
