#include "scheduler/cli/worker_lines.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "scheduler/dispatch/working_hours.h"
#include "scheduler/report/html.h"

namespace vantage {
namespace {

/// Clocks within this of each other are as good as equal: a report may be that old.
constexpr std::int64_t kSkewShownMs = 2'000;

std::string ago(std::int64_t ms) { return html::duration(static_cast<double>(ms) / 1000); }

std::string state_text(const Json& w, std::int64_t now_ms) {
  const std::string state = w.at("state");
  if (state == "lost") return fmt::format("lost {} ago", ago(now_ms - w.at("last_seen_ms").get<std::int64_t>()));
  if (state == "off hours" && !w.at("next_opening_ms").is_null())
    return "off hours until " + weekday_and_time(w.at("next_opening_ms").get<std::int64_t>());
  return state;
}

void note(std::string& text, const std::string& sentence) {
  if (!sentence.empty()) text += "    " + sentence + "\n";
}

std::string text_if(const char* what, const Json& value) {
  return value.get<std::string>().empty() ? "" : fmt::format("{}{}", what, value.get<std::string>());
}

std::string skew_text(std::int64_t skew_ms) {
  if (std::abs(skew_ms) < kSkewShownMs) return "";
  return fmt::format("its clock is {} {} ours", ago(std::abs(skew_ms)), skew_ms > 0 ? "ahead of" : "behind");
}

}  // namespace

std::string worker_lines(const Json& w, std::int64_t now_ms) {
  std::string text = fmt::format("{:<24} {:<26} on {}, {} of {} slots busy, {} cores, {} MB{}{}{}\n",
                                 w.at("id").get<std::string>(), state_text(w, now_ms), w.at("host").get<std::string>(),
                                 w.at("running").size(), w.at("slots").get<int>(), w.at("cores").get<int>(),
                                 w.at("ram_mb").get<int>(), text_if(", pool ", w.at("pool")),
                                 text_if(", tags ", w.at("tags")), text_if(", version ", w.at("build")));
  note(text, text_if("set aside until it passes its self-test: ", w.at("set_aside")));
  note(text, text_if("takes no work: ", w.at("trouble")));
  note(text, text_if("works ", w.at("hours")));
  note(text, skew_text(w.at("skew_ms").get<std::int64_t>()));
  return text;
}

}  // namespace vantage
