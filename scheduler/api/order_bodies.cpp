#include "scheduler/api/order_bodies.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"
#include "schema/base/json.h"

namespace vantage {
namespace {

/// No text at all is {}.
Json object_from(const std::string& text) {
  if (text.empty()) return Json::object();
  Json body = Json::parse(text, nullptr, false);
  if (!body.is_object()) throw Error(ErrorKind::BadInput, "the body must be a JSON object, e.g. {}");
  return body;
}

bool is_int(const Json& value) {
  return value.is_number_integer() && value >= std::numeric_limits<int>::min() &&
         value <= std::numeric_limits<int>::max();
}

template <class T>
T member(const Json& body, const char* name, T fallback, const char* expected) {
  const auto found = body.find(name);
  if (found == body.end()) return fallback;
  const bool fits = std::is_same_v<T, std::string> ? found->is_string()
                    : std::is_same_v<T, bool>      ? found->is_boolean()
                                                   : is_int(*found);
  if (!fits) throw Error(ErrorKind::BadInput, fmt::format("{} is {}, expected {}", name, found->dump(), expected));
  return found->template get<T>();
}

void refuse_unknown(const Json& body, std::initializer_list<const char*> known) {
  const std::vector<std::string> words(known.begin(), known.end());
  for (const auto& [name, value] : body.items())
    if (std::find(words.begin(), words.end(), name) == words.end())
      throw Error(ErrorKind::BadInput, fmt::format("the body has an unknown '{}'{}", name, did_you_mean(name, words)));
}

}  // namespace

SubmitRequest read_submission(const std::string& text) {
  const Json body = object_from(text);
  refuse_unknown(body, {"folder", "until", "priority"});
  SubmitRequest request{.folder = member<std::string>(body, "folder", "", "an absolute path"),
                        .until_kind = member<std::string>(body, "until", "", "a stage's name"),
                        .priority = member(body, "priority", 0, "a whole number")};
  if (!request.folder.is_absolute())
    throw Error(ErrorKind::BadInput, "folder must be the absolute path of a shot, as the scheduler sees it");
  return request;
}

Command read_order(Command command, const std::string& text) {
  const Json body = object_from(text);
  refuse_unknown(body, {"stage", "priority", "dry_run", "hours"});
  if (command.verb == Command::Verb::Priority && !body.contains("priority"))
    throw Error(ErrorKind::BadInput, "the body must say the priority, e.g. {\"priority\": 5}");
  if (command.verb == Command::Verb::Hours && !body.contains("hours"))
    throw Error(ErrorKind::BadInput,
                "the body must say the hours, e.g. {\"hours\": \"mon-fri 19:00-07:00\"}; \"\": always");
  command.priority = member(body, "priority", 0, "a whole number");
  command.stage = member<std::string>(body, "stage", "", "a stage's name");
  command.hours = member<std::string>(body, "hours", "", "hours such as \"mon-fri 19:00-07:00\"");
  command.dry_run = member(body, "dry_run", false, "true or false");
  return command;
}

}  // namespace vantage
