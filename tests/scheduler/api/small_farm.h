#pragma once
#include <filesystem>
#include <string>

#include "scheduler/store/sqlite.h"
#include "tests/support/temporary_folder.h"

namespace vantage {

/// A farm's database and a shot's folder made by hand: two cameras, one finished flow with a picture, one running job,
/// one failed job with a log, blocked renders, one worker. Made once per process and then copied: every test may change
/// its own without waiting for the disk.
class SmallFarm {
 public:
  SmallFarm();
  std::filesystem::path shot() const { return folder_.path() / "dance"; }
  std::filesystem::path state_dir() const { return shot() / ".vantage" / "farm"; }
  Sqlite& db() { return db_; }

  static constexpr int kShotId = 1, kIngestId = 1, kFlowId = 4, kRunningId = 5, kFailedId = 6;

 private:
  TemporaryFolder folder_;
  Sqlite db_;
};

/// Makes the table of counts fit the table of jobs, as the scheduler does with every move.
void count_jobs(Sqlite& db);

}  // namespace vantage
