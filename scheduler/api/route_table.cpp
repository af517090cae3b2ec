#include "scheduler/api/route_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>

#include "scheduler/api/handlers.h"

namespace vantage {
namespace {

using PathWords = std::map<std::string, std::string, std::less<>>;

constexpr std::int64_t kMaxPage = 1000;
constexpr std::size_t kMaxDigits = 18;  ///< of a number in a path: always fits into 64 bits

std::int64_t page_size(const Call& call, std::int64_t usual) {
  return std::clamp<std::int64_t>(call.integer("limit", usual), 0, kMaxPage);
}

Json shots(FarmQueries& q, const Call&) { return q.shots(); }
Json shot(FarmQueries& q, const Call& call) { return q.shot(call.number("shot")); }
Json estimate(FarmQueries& q, const Call& call) { return q.estimate(call.number("shot")); }
Json job(FarmQueries& q, const Call& call) { return q.job(call.number("job")); }
Json workers(FarmQueries& q, const Call&) { return q.workers(); }
Json audit(FarmQueries& q, const Call& call) {
  return q.audit(call.integer("before", std::numeric_limits<std::int64_t>::max()), page_size(call, 100));
}
Json jobs(FarmQueries& q, const Call& call) {
  return q.jobs(call.number("shot"), {.kind = call.text("kind"),
                                      .states = call.text("state"),
                                      .name = call.text("name"),
                                      .text = call.text("text"),
                                      .after = call.text("after"),
                                      .limit = page_size(call, 100)});
}

constexpr std::string_view kApi = "/api/v1";

const Route kRoutes[] = {
    {"GET", "/metrics", "metrics", Access::Read, nullptr, &Handlers::metrics},
    {"GET", "/api/v1/openapi.json", "openapi", Access::Open, nullptr, &Handlers::openapi},
    {"GET", "/api/v1/health", "health", Access::Read, nullptr, &Handlers::health},
    {"GET", "/api/v1/session", "session", Access::Read, nullptr, &Handlers::session},
    {"POST", "/api/v1/session", "open_session", Access::Read, nullptr, &Handlers::open_session},
    {"GET", "/api/v1/events", "events", Access::Read, nullptr, &Handlers::events},
    {"GET", "/api/v1/audit", "audit", Access::Read, audit, nullptr},
    {"GET", "/api/v1/shots", "shots", Access::Read, shots, nullptr},
    {"POST", "/api/v1/shots", "submit", Access::Operate, nullptr, &Handlers::submit},
    {"GET", "/api/v1/shots/{shot}", "shot", Access::Read, shot, nullptr},
    {"GET", "/api/v1/shots/{shot}/estimate", "estimate", Access::Read, estimate, nullptr},
    {"GET", "/api/v1/shots/{shot}/jobs", "jobs", Access::Read, jobs, nullptr},
    {"GET", "/api/v1/shots/{shot}/out/{path}", "out", Access::Read, nullptr, &Handlers::out_file},
    {"GET", "/api/v1/shots/{shot}/.vantage/store/{path}", "store", Access::Read, nullptr, &Handlers::store_file},
    {"POST", "/api/v1/shots/{shot}/{verb}", "order_shot", Access::Operate, nullptr, &Handlers::order_shot},
    {"GET", "/api/v1/jobs/{job}", "job", Access::Read, job, nullptr},
    {"GET", "/api/v1/jobs/{job}/log", "log", Access::Read, nullptr, &Handlers::log},
    {"GET", "/api/v1/jobs/{job}/preview", "preview", Access::Read, nullptr, &Handlers::preview},
    {"POST", "/api/v1/jobs/{job}/{verb}", "order_job", Access::Operate, nullptr, &Handlers::order_job},
    {"GET", "/api/v1/workers", "workers", Access::Read, workers, nullptr},
    {"POST", "/api/v1/workers/{worker}/{verb}", "order_worker", Access::Operate, nullptr, &Handlers::order_worker},
};

/// The first segment of a path that begins with '/', which is taken off.
std::string_view take_segment(std::string_view& path) {
  path.remove_prefix(1);
  const std::string_view segment = path.substr(0, path.find('/'));
  path.remove_prefix(segment.size());
  return segment;
}

bool is_number(std::string_view text) {
  return !text.empty() && text.size() <= kMaxDigits && text.find_first_not_of("0123456789") == std::string_view::npos;
}

bool fits(std::string_view word, std::string_view segment) {
  return word == "shot" || word == "job" ? is_number(segment) : !segment.empty();
}

}  // namespace

std::string Call::text(const std::string& name) const {
  const auto found = parameters.find(name);
  return found == parameters.end() ? "" : found->second;
}

std::int64_t Call::integer(const std::string& name, std::int64_t fallback) const {
  const std::string value = text(name);
  if (value.empty()) return fallback;
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error != std::errc{} || end != value.data() + value.size())
    throw Error(ErrorKind::BadInput, fmt::format("{} is '{}', expected a whole number", name, value));
  return number;
}

std::span<const Route> route_table() { return kRoutes; }

std::optional<PathWords> match_path(std::string_view pattern, std::string_view path) {
  PathWords words;
  while (pattern.starts_with('/') && path.starts_with('/')) {
    std::string_view expected = take_segment(pattern);
    if (expected == "{path}") {
      words.emplace("path", path.substr(1));
      return path.size() > 1 ? std::optional(words) : std::nullopt;
    }
    const std::string_view segment = take_segment(path);
    if (expected.starts_with('{')) {
      expected = expected.substr(1, expected.size() - 2);
      if (!fits(expected, segment)) return std::nullopt;
      words.emplace(expected, segment);
    } else if (expected != segment) {
      return std::nullopt;
    }
  }
  return pattern.empty() && path.empty() ? std::optional(words) : std::nullopt;
}

Found find_route(std::string_view method, std::string_view path) {
  Found found;
  for (const Route& route : kRoutes) {
    auto words = match_path(route.path, path);
    if (!words) continue;
    if (route.method == method) return {.route = &route, .path = std::move(*words), .allowed = {}};
    if (found.allowed.find(route.method) == std::string::npos)
      found.allowed += (found.allowed.empty() ? "" : ", ") + std::string(route.method);
  }
  return found;
}

Json answer_from_database(FarmQueries& queries, const std::string& path, const Parameters& parameters) {
  Found found = find_route("GET", std::string(kApi) + path);
  if (found.route == nullptr) throw NotFound("there is no " + std::string(kApi) + path);
  if (found.route->read == nullptr)
    throw Error(ErrorKind::BadInput,
                fmt::format("only a scheduler can answer {}: say --server http://HOST:PORT", path));
  return found.route->read(queries, {.path = std::move(found.path), .parameters = parameters});
}

}  // namespace vantage
