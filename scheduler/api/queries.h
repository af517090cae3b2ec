#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "scheduler/api/job_page.h"
#include "scheduler/report/report.h"
#include "scheduler/store/sqlite.h"
#include "schema/base/error.h"
#include "schema/base/json.h"

namespace vantage {

/// What was asked for does not exist: HTTP 404.
class NotFound : public Error {
 public:
  explicit NotFound(const std::string& message) : Error(ErrorKind::BadInput, message) {}
};

/// What people may ask about the farm, as JSON: the page, the API and the command line all answer from here.
/// Reads only. One thread at a time. Members throw NotFound for an unknown shot or job.
class FarmQueries {
 public:
  /// Throws Error(BadInput) when there is no farm in state_dir.
  explicit FarmQueries(const std::filesystem::path& state_dir) : db_(open_farm_to_read(state_dir)) {}

  Json shots();
  /// With stages in the order of the pipeline, and films.
  Json shot(std::int64_t shot_id);
  /// {total, jobs, after}: see read_job_page. total is null in a list by name.
  Json jobs(std::int64_t shot_id, const JobFilter& filter);
  /// With attempts, inputs, figures, files, history.
  Json job(std::int64_t job_id);
  /// {rest, why, critical_path, critical_path_s}: how long the shot will still take, and what decides that.
  Json estimate(std::int64_t shot_id);
  Json workers();
  struct Count {
    std::string kind, state;
    std::int64_t num = 0;
  };
  /// Jobs of all shots' present plans.
  std::vector<Count> counts_of_all();
  std::map<std::string, std::int64_t> num_shots();    ///< by state
  std::map<std::string, std::int64_t> num_workers();  ///< by state
  /// Number of the last event; 0 when there is none.
  std::int64_t newest_event() { return db_.integer_or(0, "SELECT coalesce(max(id), 0) FROM event"); }
  /// Events in order, beyond one.
  Json events_after(std::int64_t id, std::int64_t limit);
  /// {events}: who did what, the newest first, older than one; without the moves of single jobs and attempts.
  Json audit(std::int64_t before, std::int64_t limit);

  std::filesystem::path shot_folder(std::int64_t shot_id);
  /// Log of the newest attempt, or of one; empty when it has not run.
  std::filesystem::path log_path(std::int64_t job_id, std::optional<int> attempt = std::nullopt);
  /// Small picture of the job's result; empty when it has none.
  std::filesystem::path preview_path(std::int64_t job_id);
  std::int64_t job_by_name(std::int64_t shot_id, const std::string& name);
  /// Jobs whose results were made by attempts that began at or after a moment.
  int num_made_since(std::int64_t shot_id, std::int64_t wall_ms);
  /// A number that changes whenever the scheduler has written.
  std::int64_t data_version() { return db_.integer_or(0, "PRAGMA data_version"); }
  /// Everything that out/report.html is made of. Reads shot.toml: throws Error(BadInput) when that is broken.
  ReportInput report_input(std::int64_t shot_id, std::int64_t now_ms);

 private:
  Json shot_row(const Query& row);
  static Json event_row(const Query& row);
  Json counts(std::int64_t shot_id, const std::string& kind);
  std::int64_t count_of(std::int64_t shot_id, const JobFilter& filter);
  Json job_row(const Query& row);
  Json attempts(std::int64_t job_id);
  Json inputs(std::int64_t job_id);
  Json history(std::int64_t job_id);
  Json running_on(const std::string& worker_id);
  /// Empty while no attempt was ordered.
  std::string reproduce_command(std::int64_t job_id);

  Sqlite db_;
};

}  // namespace vantage
