#pragma once
/// The two messages of the farm as plain values; both are whole states, repeated until the other side has converged.
/// See schema/messages/README.md. LCM carries hints: SQLite is the truth, a renamed folder in the store is the commit.
#include <cstdint>
#include <string>
#include <vector>

namespace vantage {

constexpr int kProtocolVersion = 2;

/// One execution of a job. number and token are made in the transaction that claims the job and are never reused.
struct AttemptRef {
  std::int64_t job_id = 0;
  std::int32_t number = 0;
  std::int64_t token = 0;
  auto operator<=>(const AttemptRef&) const = default;
};

struct RunningAttempt {
  AttemptRef ref;
  std::string phase;
  double progress = 0;  ///< 0–1
  std::int32_t rss_mb = 0;
};

enum class Outcome { Done, Failed, Crashed, Canceled };

struct DoneAttempt {
  AttemptRef ref;
  Outcome outcome = Outcome::Done;
  std::string error_kind;  ///< to_string(ErrorKind) when not Done
  std::string message;     ///< one line, at most 300 bytes
  std::string content;     ///< the manifest's content hash when Done
  std::int32_t exit_code = 0, signal = 0;
  std::int64_t wall_ms = 0;
  std::int32_t peak_rss_mb = 0;
  std::string damaged_job = {};  ///< input whose artifact is not what its manifest says: the job that must run again
};

/// Worker to scheduler, on change (coalesced) and at least every second.
struct WorkerReport {
  std::string worker_id;         ///< stable over restarts of the worker
  std::int64_t incarnation = 0;  ///< higher with every start of the worker
  std::int64_t seq = 0;          ///< rises within an incarnation
  std::string host, pool;
  std::int32_t slots = 0, cores = 0, ram_mb = 0, free_disk_mb = 0;
  bool draining = false;
  std::int64_t epoch_seen = 0;  ///< of the last orders taken
  std::int64_t orders_seq_seen = 0;
  std::vector<RunningAttempt> running;    ///< assigned and not finished, queued ones included
  std::vector<DoneAttempt> done_unacked;  ///< kept until acked
  std::vector<std::string> tags = {};     ///< given to it by a person: jobs may ask for them
  std::vector<std::string> kinds = {};    ///< "depth/1": kind and version of what it can run
  std::int64_t wall_ms = 0;               ///< its clock, to show how far off it is; decides nothing
  std::string build = {};                 ///< version of its program
  std::string trouble = {};               ///< one line: why it takes no work now; "" = none
  std::int64_t num_dropped = 0;           ///< messages that it heard and did not believe
};

struct Assignment {
  AttemptRef ref;
  std::string spec_path;  ///< on shared storage; "" = `spec` says all
  std::string spec_hash;
  std::string log_path;  ///< "" = no log of its own
  std::int32_t cores = 1, ram_mb = 0, timeout_s = 0;
  std::string kind = {};  ///< "depth/1"
  std::string spec = {};  ///< with an empty spec_path: {"params": …, "unit": …} as JSON, "" = both empty
};

/// Scheduler to one worker: the complete set of attempts that it should hold.
struct WorkerOrders {
  std::string worker_id;
  std::int64_t incarnation = 0;  ///< of the worker it is meant for
  std::int64_t epoch = 0;        ///< rises with every start of the scheduler
  std::int64_t seq = 0;
  std::int32_t lease_ms = 0;
  bool reconciling = false;  ///< assigned may be incomplete: absence does not mean stop
  bool drain = false;
  std::vector<Assignment> assigned;
  std::vector<AttemptRef> canceled;
  std::vector<AttemptRef> acked;
  std::int64_t report_seq_seen = 0;  ///< newest report of that incarnation: the lease runs from when that was sent
  std::string host = {};             ///< where that incarnation runs, as it says
};

/// Scheduler to all, every second.
struct SchedulerHello {
  std::string farm_id;
  std::int64_t epoch = 0;
  std::string http_address;
  bool reconciling = false;
};

}  // namespace vantage
