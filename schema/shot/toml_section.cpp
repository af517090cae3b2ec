#include "schema/shot/toml_section.h"

#include <fmt/format.h>

#include <algorithm>

#include "schema/base/error.h"

namespace vantage {

toml::table parse_toml(const std::filesystem::path& file) {
  try {
    return toml::parse_file(file.string());
  } catch (const toml::parse_error& e) {
    throw Error(ErrorKind::BadInput, fmt::format("{}:{}:{}: TOML error: {}", file.string(), e.source().begin.line,
                                                 e.source().begin.column, e.description()));
  }
}

void with_one_line_errors(const std::function<void()>& read) {
  try {
    read();
  } catch (const Error& e) {
    std::string text = e.what();
    std::replace_if(
        text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 0x7f; }, ' ');
    throw Error(e.kind(), text);
  }
}

int line_of(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

Json to_json(const toml::node& node) {
  if (const auto* v = node.as_boolean()) return v->get();
  if (const auto* v = node.as_integer()) return v->get();
  if (const auto* v = node.as_floating_point()) return v->get();
  if (const auto* v = node.as_string()) return v->get();
  if (const auto* array = node.as_array()) {
    Json out = Json::array();
    for (const auto& item : *array) out.push_back(to_json(item));
    return out;
  }
  if (const auto* table = node.as_table()) {
    Json out = Json::object();
    for (const auto& [key, item] : *table) out[std::string(key.str())] = to_json(item);
    return out;
  }
  return nullptr;
}

Section flat_section(const toml::table& table, const std::string& file, const std::string& name) {
  Section section{.file = file, .name = name, .line = std::max(1, line_of(table)), .values = {}};
  for (const auto& [key, node] : table) section.values[std::string(key.str())] = {to_json(node), line_of(node)};
  return section;
}

}  // namespace vantage
