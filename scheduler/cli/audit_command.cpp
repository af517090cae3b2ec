#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <ctime>

#include "scheduler/cli/commands.h"
#include "scheduler/cli/farm_client.h"
#include "scheduler/cli/parse.h"
#include "schema/base/clock.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr int kPage = 500;

struct AuditQuestion {
  std::string shot, server, token_file, since;
  int limit = 100;
  bool json = false;
};

/// "90s", "15m", "8h", "2d" before now, or a local "YYYY-MM-DD[ HH:MM]".
std::int64_t since_ms(const std::string& text, std::int64_t now_ms) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc{} && end == text.data() + text.size() - 1) {
    const auto unit = std::string("smhd").find(*end);
    constexpr double kUnitMs[] = {1e3, 60e3, 3600e3, 86400e3};
    if (unit != std::string::npos) return now_ms - static_cast<std::int64_t>(number * kUnitMs[unit]);
  }
  for (const char* format : {"%Y-%m-%d %H:%M", "%Y-%m-%d"}) {
    std::tm local{};
    const char* rest = strptime(text.c_str(), format, &local);
    if (rest == nullptr || *rest != '\0') continue;
    local.tm_isdst = -1;
    return std::int64_t{std::mktime(&local)} * 1000;
  }
  throw Error(ErrorKind::BadInput,
              fmt::format("--since {}: expected e.g. 8h, 2d, 2026-01-31 or \"2026-01-31 19:00\"", text));
}

std::string local_text(std::int64_t at_ms) {
  const auto seconds = static_cast<std::time_t>(at_ms / 1000);
  std::tm local{};
  localtime_r(&seconds, &local);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &local);
  return text;
}

void print_event(const Json& e) {
  const std::string who = e.at("who");
  fmt::print("{}  {:<20} {:<9} {}\n", local_text(e.at("at_ms").get<std::int64_t>()), who.empty() ? "the farm" : who,
             e.at("kind").get<std::string>(), e.at("text").get<std::string>());
}

/// Page after page, the newest first.
Json read_events(FarmClient& client, const AuditQuestion& q, std::int64_t shot, std::int64_t since) {
  Json events = Json::array();
  Parameters parameters{{"limit", std::to_string(kPage)}};
  for (bool more = true; more && static_cast<int>(events.size()) < q.limit;) {
    const Json page = client.get("/audit", parameters).at("events");
    more = static_cast<int>(page.size()) == kPage;
    for (const auto& event : page) {
      parameters["before"] = std::to_string(event.at("id").get<std::int64_t>());
      if (event.at("at_ms") < since) return events;
      const bool wanted = shot == 0 || event.at("shot") == shot;
      if (wanted && static_cast<int>(events.size()) < q.limit) events.push_back(event);
    }
  }
  return events;
}

}  // namespace

int audit_command(const Arguments& arguments) {
  CLI::App app{"Who did what and when: people's orders, and what the farm decided by itself. The newest first.",
               "vantage audit"};
  AuditQuestion q;
  app.add_option("shot", q.shot, "folder of the shot, or its name with --server; left out: all shots and workers");
  app.add_option("--server", q.server, "a scheduler, e.g. http://127.0.0.1:8080; left out: the shot's own last run");
  app.add_option("--token-file", q.token_file, "file with the token that says who asks; else $VANTAGE_TOKEN");
  app.add_option("--since", q.since, "e.g. 8h, 2d, 2026-01-31 or \"2026-01-31 19:00\"");
  app.add_option("--limit", q.limit, "at most so many")->check(CLI::Range(1, 1'000'000))->capture_default_str();
  app.add_flag("--json", q.json, "for programs");
  parse(app, arguments);
  const std::int64_t since = q.since.empty() ? 0 : since_ms(q.since, system_clock().wall_ms());
  const auto client = make_farm_client(q.server, q.shot, q.token_file);
  const std::int64_t shot = q.shot.empty() ? 0 : find_shot(*client, q.shot);
  const Json events = read_events(*client, q, shot, since);
  if (q.json)
    fmt::print("{}\n", Json{{"events", events}}.dump());
  else
    for (const auto& event : events) print_event(event);
  return kExitOk;
}

}  // namespace vantage
