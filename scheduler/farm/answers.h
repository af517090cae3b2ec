#pragma once
/// What the farm answers to orders, as JSON: for the API, and for those who ask again.
#include "scheduler/dispatch/command.h"
#include "schema/base/ids.h"
#include "schema/base/json.h"

namespace vantage {

struct SubmitResult {
  ShotId shot{};
  std::int64_t generation = 0;
  int num_jobs = 0;        ///< planned so far
  int num_up_to_date = 0;  ///< of those, already done
};

inline void to_json(Json& json, const SubmitResult& r) {
  json = {{"shot", r.shot.value},
          {"generation", r.generation},
          {"num_jobs", r.num_jobs},
          {"num_up_to_date", r.num_up_to_date}};
}
inline void from_json(const Json& json, SubmitResult& r) {
  r = {.shot = ShotId{json.at("shot").get<std::int64_t>()},
       .generation = json.at("generation"),
       .num_jobs = json.at("num_jobs"),
       .num_up_to_date = json.at("num_up_to_date")};
}

inline void to_json(Json& json, const CommandResult& r) {
  json = {{"num_changed", r.num_changed}, {"text", r.text}, {"affected", r.affected}};
}
inline void from_json(const Json& json, CommandResult& r) {
  r = {.num_changed = json.at("num_changed"), .text = json.at("text"), .affected = json.at("affected")};
}

}  // namespace vantage
