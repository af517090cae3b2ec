#pragma once
/// Rows of the farm's database as values; see schema/sql/0001_initial.sql for what the columns mean.
#include <cstdint>
#include <filesystem>
#include <string>

#include "scheduler/store/job_state.h"
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
};

struct AttemptRow {
  AttemptRef ref;
  std::string worker_id, key;
  std::string state;    ///< leased, running, ended
  std::string outcome;  ///< of an ended one: done, failed, crashed, canceled, lost, stale
  std::string log_path;
  bool open() const { return state != "ended"; }
};

}  // namespace vantage
