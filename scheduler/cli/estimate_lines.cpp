#include "scheduler/cli/estimate_lines.h"

#include <fmt/format.h>

#include <vector>

#include "scheduler/dispatch/working_hours.h"
#include "scheduler/store/job_state.h"

namespace vantage {
namespace {

std::int64_t moment_ms(const Json& estimate, const char* name, std::int64_t now_ms) {
  return now_ms + static_cast<std::int64_t>(1000 * estimate.at(name).get<double>());
}

/// Of the jobs that are planned by now.
std::string percent_text(const Json& counts) {
  int num_good = 0, num_all = 0;
  for (const auto& [word, num] : counts.items()) {
    num_all += num.get<int>();
    if (const auto state = job_state_from(word); state && is_good(*state)) num_good += num.get<int>();
  }
  return num_all == 0 ? "nothing planned yet" : fmt::format("{} %", 100LL * num_good / num_all);
}

std::string clock_time(std::int64_t at_ms) {
  const std::string text = weekday_and_time(at_ms);
  return text.substr(text.find(' ') + 1);
}

std::string end_text(const Json& estimate, std::int64_t now_ms) {
  if (estimate.at("rest").is_null()) return fmt::format("end not known: {}", estimate.at("why").get<std::string>());
  const Json& rest = estimate.at("rest");
  const std::string text =
      fmt::format("done {} ({}-{})", weekday_and_time(moment_ms(rest, "middle_s", now_ms)),
                  clock_time(moment_ms(rest, "low_s", now_ms)), clock_time(moment_ms(rest, "high_s", now_ms)));
  const Json& unknown = rest.at("unknown_kinds");
  if (unknown.empty()) return text;
  return fmt::format("{}, not counting {}, of which nothing is known yet", text,
                     fmt::join(unknown.get<std::vector<std::string>>(), ", "));
}

}  // namespace

std::string estimate_line(const Json& counts, const Json& estimate, const Json& workers, std::int64_t now_ms) {
  std::vector<std::string> parts{percent_text(counts), end_text(estimate, now_ms)};
  if (const int num = counts.value("quarantined", 0); num > 0) parts.push_back(fmt::format("{} quarantined", num));
  if (const int num = estimate.at("num_retried"); num > 0) parts.push_back(fmt::format("{} retried", num));
  for (const auto& worker : workers)
    if (const std::string why = worker.at("set_aside"); !why.empty())
      parts.push_back(fmt::format("worker {} set aside ({})", worker.at("id").get<std::string>(), why));
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace vantage
