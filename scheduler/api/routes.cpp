#include "scheduler/api/routes.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <functional>
#include <regex>
#include <vector>

namespace vantage {
namespace {

constexpr std::int64_t kMaxPage = 1000;

struct Route {
  std::regex path;
  std::function<Json(FarmQueries&, std::int64_t id, const Parameters&)> answer;
};

std::string text_parameter(const Parameters& parameters, const std::string& name) {
  const auto found = parameters.find(name);
  return found == parameters.end() ? "" : found->second;
}

Json job_page(FarmQueries& queries, std::int64_t shot, const Parameters& p) {
  return queries.jobs(shot, {.kind = text_parameter(p, "kind"),
                             .states = text_parameter(p, "state"),
                             .text = text_parameter(p, "text"),
                             .limit = std::clamp<std::int64_t>(integer_parameter(p, "limit", 100), 0, kMaxPage),
                             .offset = std::max<std::int64_t>(integer_parameter(p, "offset", 0), 0)});
}

const std::vector<Route>& routes() {
  static const std::vector<Route> all{
      {std::regex("/shots"), [](FarmQueries& q, std::int64_t, const Parameters&) { return q.shots(); }},
      {std::regex("/shots/([0-9]{1,18})"),
       [](FarmQueries& q, std::int64_t id, const Parameters&) { return q.shot(id); }},
      {std::regex("/shots/([0-9]{1,18})/jobs"), job_page},
      {std::regex("/jobs/([0-9]{1,18})"), [](FarmQueries& q, std::int64_t id, const Parameters&) { return q.job(id); }},
      {std::regex("/workers"), [](FarmQueries& q, std::int64_t, const Parameters&) { return q.workers(); }},
  };
  return all;
}

}  // namespace

std::int64_t integer_parameter(const Parameters& parameters, const std::string& name, std::int64_t fallback) {
  const std::string text = text_parameter(parameters, name);
  if (text.empty()) return fallback;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size())
    throw Error(ErrorKind::BadInput, fmt::format("{} is '{}', expected a whole number", name, text));
  return value;
}

Json api_get(FarmQueries& queries, const std::string& path, const Parameters& parameters) {
  for (const auto& route : routes()) {
    std::smatch match;
    if (std::regex_match(path, match, route.path))
      return route.answer(queries, match.size() > 1 ? std::stoll(match[1].str()) : 0, parameters);
  }
  throw NotFound("there is no /api/v1" + path);
}

}  // namespace vantage
