#include "scheduler/cli/run_summary.h"

#include <fmt/format.h>

#include <algorithm>

#include "scheduler/api/queries.h"
#include "scheduler/cli/command_table.h"
#include "scheduler/report/html.h"
#include "scheduler/store/job_state.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMaxFailuresShown = 20, kMaxWarningsShown = 8;

int num_good_jobs(const ShotProgress& progress) {
  int sum = 0;
  for (const auto& kind : progress.kinds)
    for (const auto& [word, n] : kind.num_by_state)
      if (const auto state = job_state_from(word); state && is_good(*state)) sum += n;
  return sum;
}

}  // namespace

RunSummary summarize(const ShotProgress& progress, const fs::path& state_dir, std::int64_t start_wall_ms,
                     double wall_s) {
  FarmQueries queries(state_dir);
  RunSummary summary{.shot = progress.name,
                     .state = progress.state,
                     .error = progress.error,
                     .wall_s = wall_s,
                     .num_jobs = progress.num_jobs(),
                     .num_good = num_good_jobs(progress),
                     .num_run = queries.num_made_since(progress.shot.value, start_wall_ms),
                     .failures = {},
                     .warnings = warnings_of(queries.report_input(progress.shot.value, start_wall_ms)),
                     .results = {}};
  for (const auto& f : progress.failures)
    summary.failures.push_back(
        {f.name, f.state, f.error_kind, f.error, queries.log_path(queries.job_by_name(progress.shot.value, f.name))});
  const Json shot = queries.shot(progress.shot.value);
  if (shot.at("has_report").get<bool>()) summary.results.push_back(progress.folder / "out" / "report.html");
  for (const auto& film : shot.at("films"))
    summary.results.push_back(progress.folder / "out" / film.at("path").get<std::string>());
  return summary;
}

std::string to_text(const RunSummary& s) {
  std::string text = "\n";
  for (std::size_t i = 0; i < std::min(s.failures.size(), kMaxFailuresShown); ++i) {
    const auto& f = s.failures[i];
    text += fmt::format("{} {}: {}\n", f.job, f.state, f.error);
    if (!f.log.empty()) text += fmt::format("    log: {}\n", f.log.string());
  }
  if (s.failures.size() > kMaxFailuresShown)
    text += fmt::format("… and {} more: vantage jobs SHOT --state failed\n", s.failures.size() - kMaxFailuresShown);
  for (std::size_t i = 0; i < std::min(s.warnings.size(), kMaxWarningsShown); ++i)
    text += fmt::format("warning: {}: {}\n", s.warnings[i].job, s.warnings[i].sentence);
  if (s.warnings.size() > kMaxWarningsShown)
    text += fmt::format("… and {} more warnings: see the report\n", s.warnings.size() - kMaxWarningsShown);
  if (!s.error.empty()) text += s.error + "\n";
  for (const auto& result : s.results) text += fmt::format("  {}\n", result.string());
  const int up_to_date = std::max(0, s.num_good - s.num_run);
  return text + fmt::format("{}: {} after {}: {} of {} jobs good ({} run, {} up to date)\n", s.shot, s.state,
                            html::duration(s.wall_s), s.num_good, s.num_jobs, s.num_run, up_to_date);
}

Json to_json(const RunSummary& s) {
  Json failures = Json::array(), results = Json::array(), warnings = Json::array();
  for (const auto& f : s.failures)
    failures.push_back({{"job", f.job},
                        {"state", f.state},
                        {"error_kind", f.error_kind},
                        {"error", f.error},
                        {"log", f.log.string()}});
  for (const auto& result : s.results) results.push_back(result.string());
  for (const auto& w : s.warnings) warnings.push_back({{"job", w.job}, {"warning", w.sentence}});
  return {{"shot", s.shot},         {"state", s.state},       {"error", s.error},     {"wall_s", s.wall_s},
          {"num_jobs", s.num_jobs}, {"num_good", s.num_good}, {"num_run", s.num_run}, {"failures", failures},
          {"warnings", warnings},   {"results", results}};
}

int exit_code(const RunSummary& s) {
  if (s.state == "done" && s.failures.empty()) return kExitOk;
  const bool bad_input = std::any_of(s.failures.begin(), s.failures.end(),
                                     [](const auto& f) { return f.error_kind == to_string(ErrorKind::BadInput); });
  // Without a failed job it was the plan that failed, over what shot.toml or an artifact asks for.
  return bad_input || s.failures.empty() ? kExitMisuse : kExitFailed;
}

}  // namespace vantage
