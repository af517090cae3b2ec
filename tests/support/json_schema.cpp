#include "tests/support/json_schema.h"

#include <fmt/format.h>

#include <set>

namespace vantage {
namespace {

class Checker {
 public:
  explicit Checker(const Json& document) : document_(document) {}

  void check(const Json& schema, const Json& value, const std::string& where) {
    if (schema.contains("$ref")) return check(resolve(schema.at("$ref")), value, where);
    for (const auto& [word, unused] : schema.items())
      if (!known().contains(word)) complain(where, "the schema's word '" + word + "' is not known here");
    if (value.is_null() && schema.value("nullable", false)) return;
    const std::string type = schema.value("type", "");
    if (!type.empty() && !is_of(type, value))
      return complain(where, fmt::format("is {}, expected {}", value.dump(), type));
    if (schema.contains("enum") &&
        std::find(schema.at("enum").begin(), schema.at("enum").end(), value) == schema.at("enum").end())
      complain(where, fmt::format("is {}, expected one of {}", value.dump(), schema.at("enum").dump()));
    if (value.is_number()) check_number(schema, value, where);
    if (value.is_object()) check_object(schema, value, where);
    if (value.is_array() && schema.contains("items"))
      for (std::size_t i = 0; i < value.size(); ++i)
        check(schema.at("items"), value.at(i), fmt::format("{}/{}", where, i));
  }
  std::vector<std::string> found;

 private:
  static const std::set<std::string>& known() {
    static const std::set<std::string> words{
        "type",  "nullable", "enum",    "required",    "properties", "additionalProperties",
        "items", "minimum",  "maximum", "description", "format"};
    return words;
  }
  const Json& resolve(const std::string& ref) const { return document_.at(Json::json_pointer(ref.substr(1))); }
  void complain(const std::string& where, const std::string& what) { found.push_back(where + ": " + what); }

  static bool is_of(const std::string& type, const Json& value) {
    if (type == "object") return value.is_object();
    if (type == "array") return value.is_array();
    if (type == "string") return value.is_string();
    if (type == "boolean") return value.is_boolean();
    if (type == "integer") return value.is_number_integer();
    return type == "number" && value.is_number();
  }
  void check_number(const Json& schema, const Json& value, const std::string& where) {
    if (schema.contains("minimum") && value < schema.at("minimum")) complain(where, "is too small: " + value.dump());
    if (schema.contains("maximum") && value > schema.at("maximum")) complain(where, "is too large: " + value.dump());
  }
  void check_object(const Json& schema, const Json& value, const std::string& where) {
    for (const auto& name : schema.value("required", Json::array()))
      if (!value.contains(name.get<std::string>())) complain(where, "lacks " + name.get<std::string>());
    const Json properties = schema.value("properties", Json::object());
    const Json others = schema.value("additionalProperties", Json(true));
    for (const auto& [name, member] : value.items()) {
      if (properties.contains(name))
        check(properties.at(name), member, where + "/" + name);
      else if (others.is_object())
        check(others, member, where + "/" + name);
      else if (!others.get<bool>())
        complain(where, "has " + name + ", which the schema does not know");
    }
  }

  const Json& document_;
};

}  // namespace

std::vector<std::string> schema_violations(const Json& document, const Json& schema, const Json& value) {
  Checker checker(document);
  checker.check(schema, value, "");
  return checker.found;
}

}  // namespace vantage
