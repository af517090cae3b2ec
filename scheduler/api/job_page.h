#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scheduler/store/sqlite.h"

namespace vantage {

/// Which rows of the table of jobs. Empty text means all.
struct JobFilter {
  std::string kind{};
  std::string states{};  ///< separated by commas
  std::string name{};    ///< the whole name of one job
  std::string text{};    ///< part of the name, case aside
  std::string after{};   ///< JobPage::after of the page before
  std::int64_t limit = 100;
};

/// A part of a list of jobs that costs the same wherever it lies and however long the list is.
struct JobPage {
  std::vector<std::int64_t> ids;
  std::string after{};  ///< where the next page begins; "" at the end of the list
};

/// Jobs of the shot's present plan. What is at work comes first, then what failed, what is ready, what is done (the
/// newest first), the rest. With `text`, by name; one call looks at no more than 20,000 names, so that a page may be
/// short or empty and the list still go on.
/// Throws Error(BadInput) for a bad `after`.
JobPage read_job_page(Sqlite& db, std::int64_t shot_id, const JobFilter& filter);

}  // namespace vantage
