#pragma once
/// The few events of a farm's trail that people want to be told of.
#include <cstdint>
#include <string>
#include <vector>

#include "scheduler/store/sqlite.h"
#include "schema/base/json.h"

namespace vantage {

struct Happening {
  std::int64_t id = 0;  ///< of the event row: rises, never comes twice
  std::string event;    ///< one of notify_events()
  Json facts;           ///< what a hook gets: event, id, at_ms, text and, where it has them, shot, job, worker
};

struct Happenings {
  std::vector<Happening> list;
  std::int64_t seen_to = 0;  ///< look on from here; all rows up to it were looked at
};

/// After row `after`, a bounded number of rows at a time: call again until seen_to stays.
Happenings happenings_after(Sqlite& db, std::int64_t after);

/// The last event row so far.
std::int64_t last_event(Sqlite& db);

}  // namespace vantage
