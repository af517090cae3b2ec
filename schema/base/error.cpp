#include "schema/base/error.h"

#include <fmt/format.h>

#include <array>
#include <utility>

namespace vantage {
namespace {
constexpr std::array<std::pair<ErrorKind, std::string_view>, 5> kNames{{{ErrorKind::BadInput, "bad_input"},
                                                                        {ErrorKind::Transient, "transient"},
                                                                        {ErrorKind::Resource, "resource"},
                                                                        {ErrorKind::Crash, "crash"},
                                                                        {ErrorKind::Bug, "bug"}}};
}  // namespace

std::string_view to_string(ErrorKind kind) {
  for (const auto& [value, name] : kNames)
    if (value == kind) return name;
  return "bug";
}

ErrorKind error_kind_from(std::string_view word) {
  for (const auto& [value, name] : kNames)
    if (name == word) return value;
  return ErrorKind::Bug;
}

void check(bool cond, std::string_view why_it_must_hold, std::source_location where) {
  if (!cond)
    throw Error(ErrorKind::Bug,
                fmt::format("{}:{}: broken assumption: {}", where.file_name(), where.line(), why_it_must_hold));
}

}  // namespace vantage
