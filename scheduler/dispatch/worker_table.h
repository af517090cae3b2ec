#pragma once
/// What the scheduler knows of the workers now: rebuilt from the database and their reports after a restart.
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "scheduler/dispatch/worker_standing.h"
#include "scheduler/dispatch/working_hours.h"
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

/// What a job, or a class of jobs, asks of a worker besides room. Looks at texts that others hold.
struct Wanted {
  std::string_view kind, pool, tags;
  std::optional<int> version{};  ///< of the kind; empty: any
  std::optional<JobId> job{};    ///< empty: any of its class
};

struct LiveWorker {
  WorkerReport report;          ///< the newest
  std::int64_t seen_ms = 0;     ///< monotonic; 0: not since the scheduler started
  std::int64_t written_ms = 0;  ///< monotonic: its row
  bool drained = false;         ///< by a person
  bool lost = false;
  WorkingHours hours;
  bool outside_hours = false;  ///< as of this minute
  WorkerStanding standing;
  std::string set_aside;          ///< why it gets no work until it passes its self-test; empty: it is trusted
  std::int64_t next_test_ms = 0;  ///< monotonic
  std::map<AttemptRef, Held> held;
  std::set<AttemptRef> canceled;  ///< until it does not report them any more
  std::set<AttemptRef> acked;     ///< until it does not report them any more

  bool changed = false;          ///< its orders differ from those sent last
  std::int64_t seq = 0;          ///< of the orders sent last
  std::int64_t changed_seq = 0;  ///< of the first orders with the present content
  std::int64_t next_send_ms = 0;
  int num_repeats = 0;

  bool takes_work() const { return seen_ms > 0 && report.slots > 0 && state() == "active"; }
  /// Column worker.state: lost, draining, set aside, in trouble, off hours or active; what holds longest stands first.
  std::string_view state() const;
  /// It can run this kind; of any version when none is named. One that does not say what it can is believed to.
  bool offers(std::string_view kind, std::optional<int> version = std::nullopt) const;
  /// Kind, pool and tags are its own.
  bool serves(const Wanted& wanted) const;
  int used_cores() const;
  int used_ram_mb() const;
  bool runs_something_alone() const;
};

}  // namespace vantage
