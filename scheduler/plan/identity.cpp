#include "scheduler/plan/identity.h"

#include <fmt/format.h>

#include <set>
#include <vector>

namespace vantage {
namespace {

Json contents_of(const std::map<std::string, JobFile::Input>& inputs) {
  Json out = Json::object();
  for (const auto& [name, input] : inputs) out[name] = input.content;
  return out;
}

/// Long values would hide the sentence.
std::string short_text(const Json& value) {
  constexpr std::size_t kMaxBytes = 40;
  const std::string text = value.dump();
  return text.size() <= kMaxBytes ? text : "…";
}

std::set<std::string> keys_of(const Json& a, const Json& b) {
  std::set<std::string> keys;
  for (const auto& [key, value] : a.items()) keys.insert(key);
  for (const auto& [key, value] : b.items()) keys.insert(key);
  return keys;
}

void compare_values(const std::string& what, const Json& a, const Json& b, std::vector<std::string>& differences) {
  for (const auto& key : keys_of(a, b)) {
    const Json from = a.value(key, Json()), to = b.value(key, Json());
    if (from != to) differences.push_back(fmt::format("{}.{} {} → {}", what, key, short_text(from), short_text(to)));
  }
}

void compare_contents(const std::string& what, const Json& a, const Json& b, std::vector<std::string>& differences) {
  for (const auto& key : keys_of(a, b)) {
    if (!a.contains(key))
      differences.push_back(fmt::format("{} {} is new", what, key));
    else if (!b.contains(key))
      differences.push_back(fmt::format("{} {} is gone", what, key));
    else if (a.at(key) != b.at(key))
      differences.push_back(fmt::format("{} {} changed", what, key));
  }
}

}  // namespace

Json identity_of(const JobFile& job) {
  return {{"version", job.version},
          {"params", job.params},
          {"unit", job.unit},
          {"inputs", contents_of(job.inputs)},
          {"sources", contents_of(job.sources)}};
}

std::string explain_change(const Json& a, const Json& b) {
  std::vector<std::string> differences;
  if (a.at("version") != b.at("version"))
    differences.push_back(fmt::format("version {} → {}", a.at("version").dump(), b.at("version").dump()));
  compare_values("params", a.at("params"), b.at("params"), differences);
  compare_values("unit", a.at("unit"), b.at("unit"), differences);
  compare_contents("source", a.at("sources"), b.at("sources"), differences);
  compare_contents("input", a.at("inputs"), b.at("inputs"), differences);
  constexpr std::size_t kMaxNamed = 3;
  const std::size_t num_named = std::min(kMaxNamed, differences.size());
  std::string text = fmt::format(
      "{}", fmt::join(differences.begin(), differences.begin() + static_cast<std::ptrdiff_t>(num_named), ", "));
  if (differences.size() > num_named) text += fmt::format(" and {} more", differences.size() - num_named);
  return text;
}

}  // namespace vantage
