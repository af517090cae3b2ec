// The API's description and the server say the same.
#include "scheduler/api/openapi.h"

#include <algorithm>
#include <set>

#include "tests/scheduler/api/api_server.h"
#include "tests/support/json_schema.h"

namespace vantage {
namespace {

class OpenApi : public ApiServer {
 protected:
  const Json document_ = Json::parse(openapi_text());

  Json operation(const Route& route) const {
    std::string method(route.method);
    std::transform(method.begin(), method.end(), method.begin(), [](unsigned char c) { return std::tolower(c); });
    return document_.at("paths").value(std::string(route.path), Json::object()).value(method, Json());
  }
  void expect_described(const Route& route, const httplib::Result& answer) {
    ASSERT_TRUE(answer) << route.name;
    const Json responses = operation(route).at("responses");
    const std::string status = std::to_string(answer->status);
    ASSERT_TRUE(responses.contains(status)) << route.name << " answers " << status << ": " << answer->body;
    const Json content = responses.at(status).at("content");
    if (!content.contains("application/json")) return;
    EXPECT_EQ(answer->get_header_value("Content-Type"), "application/json") << route.name;
    const Json schema = content.at("application/json").at("schema");
    for (const auto& violation : schema_violations(document_, schema, Json::parse(answer->body)))
      ADD_FAILURE() << route.name << " " << status << violation;
  }
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  if (const auto at = text.find(from); at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

/// A real path for each of the patterns; what exists, or what does not.
std::string path_of(const Route& route, bool exists) {
  std::string path = replaced(std::string(route.path), "{shot}", exists ? "1" : "99");
  path = replaced(path, "{job}", !exists ? "999" : route.name == "preview" ? "4" : "6");
  path = replaced(path, "{worker}", "w1");
  path = replaced(path, "{verb}", !exists ? "explode" : route.name == "order_worker" ? "drain" : "retry");
  const std::string file = route.name == "out" ? "render/freeze/freeze.mp4" : "align/e1/clocks.json";
  return replaced(path, "{path}", exists ? file : "no/such.file");
}

TEST_F(OpenApi, DescribesEveryRouteOfTheServerAndNoOther) {
  std::set<std::string> served, described;
  for (const Route& route : route_table()) served.insert(std::string(route.method) + " " + std::string(route.path));
  for (const auto& [path, methods] : document_.at("paths").items())
    for (const auto& [method, operation] : methods.items())
      described.insert(replaced(replaced(method, "get", "GET"), "post", "POST") + " " + path);
  EXPECT_EQ(served, described);
}

TEST_F(OpenApi, NamesAndRightsAreThoseOfTheServer) {
  constexpr const char* kRoles[] = {"open", "read", "operate"};
  for (const Route& route : route_table()) {
    EXPECT_EQ(operation(route).at("operationId"), route.name);
    EXPECT_EQ(operation(route).at("x-role"), kRoles[static_cast<int>(route.access)]) << route.name;
    EXPECT_FALSE(operation(route).at("summary").get<std::string>().empty()) << route.name;
  }
}

TEST_F(OpenApi, ParametersInPathsAreThoseOfTheServer) {
  for (const Route& route : route_table()) {
    std::set<std::string> described;
    for (const auto& parameter : operation(route).value("parameters", Json::array()))
      if (parameter.at("in") == "path") described.insert("{" + parameter.at("name").get<std::string>() + "}");
    for (const auto& word : described) EXPECT_NE(route.path.find(word), std::string::npos) << route.name << word;
    EXPECT_EQ(described.size(), std::count(route.path.begin(), route.path.end(), '{')) << route.name;
  }
}

TEST_F(OpenApi, AnswersFitTheirSchemas) {
  for (const Route& route : route_table()) {
    if (route.name == "events") continue;  // never ends
    const std::string path = path_of(route, true);
    if (route.method == "GET")
      expect_described(route, http_.Get(path));
    else
      expect_described(route, post(path, route.name == "submit" ? R"({"folder": "/shots/a"})" : ""));
  }
}

TEST_F(OpenApi, ErrorsFitTheirSchemas) {
  const httplib::Headers stranger{{"X-Forwarded-For", "203.0.113.7"}};
  for (const Route& route : route_table()) {
    if (route.access != Access::Open) {
      const auto answer = route.method == "GET" ? http_.Get(path_of(route, true), stranger)
                                                : http_.Post(path_of(route, true), stranger, "", "application/json");
      ASSERT_EQ(answer->status, 401) << route.name;
      expect_described(route, answer);
    }
    if (route.path.find('{') == std::string_view::npos) continue;
    const std::string missing = path_of(route, false);
    const auto answer = route.method == "GET" ? http_.Get(missing) : post(missing);
    ASSERT_EQ(answer->status, 404) << route.name;
    expect_described(route, answer);
  }
  EXPECT_FALSE(command_ || submitted_);
}

TEST(JsonSchema, SaysWhatDoesNotFit) {
  const Json document = Json::parse(R"({"s": {"type": "string", "nullable": true}})");
  const Json schema =
      Json::parse(R"({"type": "object", "required": ["a", "b"], "additionalProperties": false, "properties":
    {"a": {"type": "integer", "minimum": 0}, "b": {"$ref": "#/s"}, "c": {"type": "array", "items": {"enum": [1, 2]}}}})");
  const auto num = [&](const char* value) { return schema_violations(document, schema, Json::parse(value)).size(); };
  EXPECT_EQ(num(R"({"a": 1, "b": null, "c": [1, 2]})"), 0u);
  for (const char* bad : {R"({"a": 1})", R"({"a": -1, "b": ""})", R"({"a": 1.5, "b": ""})", R"({"a": 1, "b": 2})",
                          R"({"a": 1, "b": "", "c": [3]})", R"({"a": 1, "b": "", "d": 0})", "[]"})
    EXPECT_EQ(num(bad), 1u) << bad;
  EXPECT_EQ(schema_violations(document, {{"pattern", "x"}}, 1).size(), 1u) << "an unknown word is not overlooked";
}

}  // namespace
}  // namespace vantage
