#pragma once
/// Rows of the farm's database as values; see schema/sql/0001_initial.sql for what the columns mean.
#include <cstdint>
#include <filesystem>
#include <string>

#include "scheduler/store/job_state.h"
#include "schema/base/error.h"
#include "schema/base/ids.h"
#include "schema/messages/protocol.h"

namespace vantage {

struct ShotRow {
  ShotId id;
  std::filesystem::path folder;
  std::string name;
  int priority = 0;
  std::string state;  ///< running, done, failed, paused
  std::string until_kind;
  std::int64_t generation = 0;
  std::string error;
};

struct JobRow {
  JobId id;
  ShotId shot;
  std::string name, kind;
  int stage = 0, version = 0;
  std::int64_t generation = 0;
  std::string plan_hash;
  std::string params, unit, sources, links;  ///< JSON
  std::string key, identity, content;
  JobState state = JobState::Blocked;
  int priority = 0, num_unmet = 0;
  int cores = 1, ram_mb = 0, timeout_s = 0;
  int num_attempts = 0, num_failures = 0, num_crashes = 0;
  std::int64_t not_before_ms = 0;
  std::string reason;
  std::string pool, tags;  ///< of the workers that may run it: '' = any; tags: words, one space between
};

/// What moves of a job need: read many times per job, so without its texts.
struct JobBrief {
  JobId id;
  ShotId shot;
  std::string name, kind, key;
  JobState state = JobState::Blocked;
  std::int64_t generation = 0, class_id = 0, not_before_ms = 0, wall_ms = 0;
  int num_unmet = 0, num_attempts = 0;
  bool has_links = false;

  bool claimable() const { return state == JobState::Ready && not_before_ms == 0; }
};

/// What a new plan is compared with.
struct JobOutline {
  JobId id;
  std::string name, kind, plan_hash, content;
  JobState state = JobState::Blocked;
  std::int64_t generation = 0;
  int num_unmet = 0;
};

/// Jobs that can be claimed now and that a worker can take equally well, or not at all.
struct ReadyClass {
  std::int64_t id = 0;
  ShotId shot;
  std::string kind, pool, tags;
  int cores = 1, ram_mb = 0;
  bool alone = false;  ///< crashed before: nothing else may run beside them
  // Of its best job:
  int priority = 0, stage = 0;
  JobId first;
};

/// Tells an unchanged file from a changed one without reading it.
struct FileStamp {
  std::int64_t size = 0, mtime_ns = 0, inode = 0;
  bool operator==(const FileStamp&) const = default;
};

struct AttemptRow {
  AttemptRef ref;
  std::string worker_id, key;
  std::string state;    ///< leased, running, ended
  std::string outcome;  ///< of an ended one: done, failed, crashed, canceled, lost, stale
  std::string log_path;
  bool open() const { return state != "ended"; }
};

/// Tells an order that was sent twice from two orders.
struct OnceKey {
  std::string key{};          ///< the caller's; empty: carried out as often as it comes
  std::string who{};          ///< whose key it is
  std::string fingerprint{};  ///< of the whole request
};
/// The key came with another request before.
class KeyReused : public Error {
 public:
  explicit KeyReused(const std::string& message) : Error(ErrorKind::BadInput, message) {}
};

}  // namespace vantage
