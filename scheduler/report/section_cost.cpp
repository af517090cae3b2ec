// What went wrong, what to mind, and where the time went.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "scheduler/report/html.h"
#include "scheduler/report/sections.h"

namespace vantage::report {
namespace {

constexpr std::size_t kMaxListed = 50;

struct StageCost {
  std::size_t num_jobs = 0;
  double total_s = 0, longest_s = 0;
  int peak_rss_mb = 0;
};

std::map<std::string, StageCost> cost_by_kind(const ReportInput& input) {
  std::map<std::string, StageCost> costs;
  for (const auto& job : input.jobs) {
    StageCost& cost = costs[job.kind];
    const double wall_s = static_cast<double>(job.wall_ms) / 1000;
    ++cost.num_jobs;
    cost.total_s += wall_s;
    cost.longest_s = std::max(cost.longest_s, wall_s);
    cost.peak_rss_mb = std::max(cost.peak_rss_mb, job.peak_rss_mb);
  }
  return costs;
}

std::string bar(double share) {
  return fmt::format(
      "<svg viewBox=\"0 0 300 12\" style=\"width:300px\"><rect width=\"{:.1f}\" height=\"12\" rx=\"3\" "
      "fill=\"var(--accent)\"/></svg>",
      300 * share);
}

}  // namespace

std::string failures(const ReportInput& input) {
  std::vector<std::vector<std::string>> rows{{"job", "state", "what happened"}};
  std::size_t num_aborted = 0, num_more = 0;
  for (const auto& job : input.jobs) {
    if (job.state == "aborted") ++num_aborted;
    if (job.state != "failed" && job.state != "quarantined") continue;
    if (rows.size() > kMaxListed) {
      ++num_more;
      continue;
    }
    const std::string log = job.log_path.empty() ? "" : "<br><code>" + html::escape(job.log_path) + "</code>";
    rows.push_back({"<code>" + html::escape(job.name) + "</code>", html::escape(job.state),
                    "<span class=\"bad\">" + html::escape(job.error) + "</span>" + log});
  }
  if (rows.size() == 1) return {};
  std::string out = html::table(rows);
  if (num_more > 0) out += fmt::format("<p>and {} more</p>", num_more);
  if (num_aborted > 0) out += fmt::format("<p class=\"lead\">{} jobs were not run because of these.</p>", num_aborted);
  return out;
}

std::string warnings(const ReportInput& input) {
  const auto all = warnings_of(input);
  if (all.empty()) return {};
  std::string items;
  for (std::size_t i = 0; i < std::min(all.size(), kMaxListed); ++i)
    items += fmt::format("<li><code>{}</code> <span class=\"warn\">{}</span></li>", html::escape(all[i].job),
                         html::escape(all[i].sentence));
  if (all.size() > kMaxListed) items += fmt::format("<li>and {} more</li>", all.size() - kMaxListed);
  return "<ul>" + items + "</ul>";
}

std::string cost(const ReportInput& input) {
  const auto costs = cost_by_kind(input);
  double total_s = 0, most_s = 1e-9;
  for (const auto& [kind, cost] : costs) {
    total_s += cost.total_s;
    most_s = std::max(most_s, cost.total_s);
  }
  if (total_s <= 0) return {};
  std::vector<std::vector<std::string>> rows{{"stage", "", "work", "jobs", "longest", "most memory"}};
  for (const auto& kind : input.kinds) {
    const auto found = costs.find(kind);
    if (found == costs.end()) continue;
    const StageCost& c = found->second;
    rows.push_back({html::escape(kind), bar(c.total_s / most_s), html::duration(c.total_s), std::to_string(c.num_jobs),
                    html::duration(c.longest_s), c.peak_rss_mb > 0 ? fmt::format("{} MB", c.peak_rss_mb) : ""});
  }
  return html::table(rows) +
         fmt::format("<p class=\"lead\"><b>{}</b> of work by all jobs together</p>", html::duration(total_s));
}

}  // namespace vantage::report
