#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <tuple>

#include "scheduler/store/job_state.h"
#include "scheduler/store/sqlite.h"
#include "schema/base/ids.h"

namespace vantage {

/// Differences of the counted columns (job_count, need_class.num_ready) since they were last written: many jobs change
/// in a transaction, few counts do.
class Tally {
 public:
  void add_jobs(ShotId shot, const std::string& kind, JobState state, int num, std::int64_t wall_ms);
  void add_ready(std::int64_t class_id, int num) { ready_[class_id] += num; }
  /// Within the caller's transaction; afterwards there are no differences.
  void write(Sqlite& db);

 private:
  struct Difference {
    int num = 0;
    std::int64_t wall_ms = 0;
  };
  std::map<std::tuple<ShotId, std::string, JobState>, Difference> jobs_;
  std::map<std::int64_t, int> ready_;
};

}  // namespace vantage
