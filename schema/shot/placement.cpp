#include "schema/shot/placement.h"

#include <fmt/format.h>

#include <regex>
#include <set>

#include "schema/base/error.h"

namespace vantage {
namespace {

/// The kind's own value, else that of all kinds; nullptr when neither is there.
const LocatedValue* find_value(const Section& farm, const std::string& kind, const std::string& key) {
  for (const std::string& name : {kind + "." + key, key})
    if (const auto found = farm.values.find(name); found != farm.values.end()) return &found->second;
  return nullptr;
}

[[noreturn]] void refuse(const Section& farm, const LocatedValue& v, const std::string& key, const char* expected) {
  throw Error(ErrorKind::BadInput,
              fmt::format("{}:{}: {} is {}, expected {}", farm.file, v.line, key, v.value.dump(), expected));
}

bool is_word(const Json& value) {
  static const std::regex word("[A-Za-z0-9_.:-]+");
  return value.is_string() && std::regex_match(value.get<std::string>(), word);
}

std::string words_in_order(const Section& farm, const LocatedValue& v) {
  constexpr const char* kExpected = "a list of words of letters, digits and _.:-";
  if (!v.value.is_array()) refuse(farm, v, "tags", kExpected);
  std::set<std::string> words;
  for (const Json& word : v.value) {
    if (!is_word(word)) refuse(farm, v, "tags", kExpected);
    words.insert(word.get<std::string>());
  }
  return fmt::format("{}", fmt::join(words, " "));
}

}  // namespace

Placement placement_of(const Shot& shot, const std::string& kind) {
  const Section farm = shot.section("farm");
  Placement placement;
  if (const LocatedValue* pool = find_value(farm, kind, "pool")) {
    const bool any = pool->value.is_string() && pool->value.get<std::string>().empty();
    if (!any && !is_word(pool->value)) refuse(farm, *pool, "pool", "a word of letters, digits and _.:-");
    placement.pool = pool->value.get<std::string>();
  }
  if (const LocatedValue* tags = find_value(farm, kind, "tags")) placement.tags = words_in_order(farm, *tags);
  return placement;
}

void move_placement(Section& kind, Section& farm) {
  for (const char* key : {"pool", "tags"})
    if (auto value = kind.values.extract(key)) {
      value.key() = kind.name + "." + key;
      farm.values.insert(std::move(value));
    }
}

}  // namespace vantage
