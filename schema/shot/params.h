#pragma once
/// Options written once: a struct of values with one member function
///
///   void fields(auto&& field) { field("window_px", window_px, Range{3, 64}, "side of the patch"); }
///
/// is walked here to read TOML and JSON, check ranges, and describe itself.
#include <fmt/format.h>

#include <algorithm>
#include <concepts>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"
#include "schema/shot/section.h"

namespace vantage {

/// Inclusive bounds of a number.
struct Range {
  double min;
  double max;
};
/// The words an option, or each item of a list, may be.
struct OneOf {
  std::vector<std::string> words;
};
/// Any text, any list of texts, any bool.
struct Any {};

/// What --help and the page show of an option.
struct ParamDoc {
  std::string name, meaning, allowed;
  Json default_value;
};

namespace params_detail {

inline std::string describe(const Range& r) { return fmt::format("{} to {}", r.min, r.max); }
inline std::string describe(const OneOf& o) { return fmt::format("one of {}", fmt::join(o.words, ", ")); }
inline std::string describe(const Any&) { return "any"; }

template <class T>
bool fits(const Json& v) {
  if constexpr (std::same_as<T, bool>)
    return v.is_boolean();
  else if constexpr (std::integral<T>)
    return v.is_number_integer();
  else if constexpr (std::floating_point<T>)
    return v.is_number();
  else if constexpr (std::same_as<T, std::vector<std::string>>)
    return v.is_array() && std::all_of(v.begin(), v.end(), [](const Json& item) { return item.is_string(); });
  else
    return v.is_string();
}
template <class T>
const char* type_name() {
  if constexpr (std::same_as<T, bool>)
    return "true or false";
  else if constexpr (std::integral<T>)
    return "a whole number";
  else if constexpr (std::floating_point<T>)
    return "a number";
  else if constexpr (std::same_as<T, std::vector<std::string>>)
    return "a list of texts";
  else
    return "text";
}

inline bool allowed(const Json& v, const Range& r) { return v.get<double>() >= r.min && v.get<double>() <= r.max; }
/// The first word that is none of them, of one text or a list.
inline std::optional<std::string> odd_word(const Json& v, const OneOf& o) {
  const Json list = v.is_array() ? v : Json::array({v});
  for (const auto& word : list.get<std::vector<std::string>>())
    if (std::find(o.words.begin(), o.words.end(), word) == o.words.end()) return word;
  return std::nullopt;
}
inline bool allowed(const Json& v, const OneOf& o) { return !odd_word(v, o); }
inline bool allowed(const Json&, const Any&) { return true; }

/// where: "shot.toml:12: [depth] max_error_px".
template <class T, class Limits>
void assign(T& member, const Json& v, const Limits& limits, const std::string& where) {
  if (!fits<T>(v))
    throw Error(ErrorKind::BadInput, fmt::format("{}: is {}, expected {}", where, v.dump(), type_name<T>()));
  if (!allowed(v, limits)) {
    std::string hint;
    if constexpr (std::same_as<Limits, OneOf>) hint = did_you_mean(*odd_word(v, limits), limits.words);
    throw Error(ErrorKind::BadInput, fmt::format("{}: is {}, expected {}{}", where, v.dump(), describe(limits), hint));
  }
  member = v.get<T>();
}

}  // namespace params_detail

template <class P>
std::vector<ParamDoc> describe_params() {
  std::vector<ParamDoc> docs;
  P params;
  params.fields([&](const char* name, auto& member, const auto& limits, const char* meaning) {
    docs.push_back({name, meaning, params_detail::describe(limits), Json(member)});
  });
  return docs;
}

template <class P>
Json params_to_json(P params) {
  Json out = Json::object();
  params.fields([&](const char* name, auto& member, const auto&, const char*) { out[name] = member; });
  return out;
}

/// Throws Error(BadInput) with file and line for an unknown key (with a suggestion), a wrong type or a value out of
/// range.
template <class P>
P params_from_section(const Section& section) {
  P params;
  std::vector<std::string> known;
  params.fields([&](const char* name, auto& member, const auto& limits, const char*) {
    known.emplace_back(name);
    if (const auto found = section.values.find(name); found != section.values.end())
      params_detail::assign(member, found->second.value, limits, section.where(name));
  });
  for (const auto& [key, value] : section.values)
    if (std::find(known.begin(), known.end(), key) == known.end())
      throw Error(ErrorKind::BadInput, section.where(key) + ": unknown key" + did_you_mean(key, known));
  return params;
}

/// The inverse of params_to_json; strict, since only we write it.
template <class P>
P params_from_json(const Json& json) {
  P params;
  params.fields([&](const char* name, auto& member, const auto& limits, const char*) {
    if (json.contains(name)) params_detail::assign(member, json.at(name), limits, std::string("params.") + name);
  });
  return params;
}

}  // namespace vantage
