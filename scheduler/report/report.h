#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "schema/shot/shot.h"

namespace vantage {

/// What the report needs to know of one job.
struct ReportJob {
  std::string name, kind, state;
  std::filesystem::path artifact;  ///< empty while there is none
  std::string error_kind, error, log_path;
  std::int64_t wall_ms = 0;
  int peak_rss_mb = 0;
};

struct ReportInput {
  Shot shot;
  std::string state;               ///< running, done, failed, paused
  std::string error;               ///< of the shot itself
  std::vector<std::string> kinds;  ///< in the order of the pipeline
  std::vector<ReportJob> jobs;
  std::int64_t submitted_ms = 0;
  std::optional<std::int64_t> finished_ms;
  std::int64_t now_ms = 0;
};

/// A sentence that a finished job wants read.
struct JobWarning {
  std::string job, sentence;
};
std::vector<JobWarning> warnings_of(const ReportInput& input);

/// One page, complete in itself but for the films and big pictures below SHOT/out, which it links to.
/// An artifact that cannot be read leaves a sentence in its place: the report of a broken run matters most.
std::string report_html(const ReportInput& input);

/// Writes SHOT/out/report.html in one step. Throws Error(Resource) when the disk is full.
void write_report(const ReportInput& input);

}  // namespace vantage
