#pragma once
/// What the scheduler knows of the workers now: rebuilt from the database and their reports after a restart.
#include <map>
#include <set>
#include <string>

#include "schema/base/ids.h"
#include "schema/messages/protocol.h"

namespace vantage {

/// An attempt that is out with a worker.
struct Held {
  Assignment assignment;
  ShotId shot;
  std::string kind, key;              ///< key: of the result that it makes
  std::int64_t claimed_ms = 0;        ///< monotonic
  std::int64_t lease_until_ms = 0;    ///< monotonic
  std::int64_t assigned_seq = 0;      ///< of the first orders with it; 0: not yet sent
  std::int64_t invalid_since_ms = 0;  ///< reported done, but its artifact cannot be read (yet)
  bool started = false;
  bool reconnects = false;  ///< of before the scheduler's start, not yet reported since
  std::string phase;        ///< as written last
  double progress = 0;
  bool alone = false;  ///< crashed before: nothing else may run beside it
};

struct LiveWorker {
  WorkerReport report;          ///< the newest
  std::int64_t seen_ms = 0;     ///< monotonic; 0: not since the scheduler started
  std::int64_t written_ms = 0;  ///< monotonic: its row
  bool drained = false;         ///< by a person
  bool lost = false;
  std::map<AttemptRef, Held> held;
  std::set<AttemptRef> canceled;  ///< until it does not report them any more
  std::set<AttemptRef> acked;     ///< until it does not report them any more

  bool changed = false;          ///< its orders differ from those sent last
  std::int64_t seq = 0;          ///< of the orders sent last
  std::int64_t changed_seq = 0;  ///< of the first orders with the present content
  std::int64_t next_send_ms = 0;
  int num_repeats = 0;

  bool takes_work() const { return seen_ms > 0 && !lost && !drained && !report.draining && report.slots > 0; }
  int used_cores() const;
  int used_ram_mb() const;
  bool runs_something_alone() const;
};

}  // namespace vantage
