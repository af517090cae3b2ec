#pragma once
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "scheduler/api/gate.h"
#include "scheduler/api/queries.h"

namespace httplib {
struct Request;
struct Response;
}  // namespace httplib

namespace vantage {

using Parameters = std::map<std::string, std::string>;

/// One request to a route.
struct Call {
  std::map<std::string, std::string, std::less<>> path;  ///< what stands for {shot}, {verb} …
  Parameters parameters;                                 ///< after the question mark
  Pass pass{};
  const httplib::Request* request = nullptr;  ///< null when the command line asks the database itself

  std::int64_t number(std::string_view name) const { return std::stoll(path.find(name)->second); }
  const std::string& word(std::string_view name) const { return path.find(name)->second; }
  /// A whole number, or the fallback when the parameter is not there. Throws Error(BadInput).
  std::int64_t integer(const std::string& name, std::int64_t fallback) const;
  std::string text(const std::string& name) const;
};

class Handlers;

/// One line of the API. openapi.json describes each under its name.
struct Route {
  std::string_view method;  ///< GET or POST
  /// {shot} and {job} stand for numbers, {path} for all the rest, other words in braces for one segment.
  std::string_view path;
  std::string_view name;
  Access access = Access::Read;
  Json (*read)(FarmQueries&, const Call&) = nullptr;                    ///< answers from the database alone, or
  void (Handlers::*handle)(const Call&, httplib::Response&) = nullptr;  ///< with more than that
};

/// The whole API; the first that matches answers.
std::span<const Route> route_table();

/// What stands in the path for the words in braces; empty when it does not match.
std::optional<std::map<std::string, std::string, std::less<>>> match_path(std::string_view pattern,
                                                                          std::string_view path);

struct Found {
  const Route* route = nullptr;  ///< null: nothing has this path, or not with this method
  std::map<std::string, std::string, std::less<>> path;
  std::string allowed;  ///< methods of the path, "GET, POST", when only the method is wrong
};
Found find_route(std::string_view method, std::string_view path);

/// GET without a server, for the command line. Throws NotFound for what is not there or needs a scheduler.
Json answer_from_database(FarmQueries& queries, const std::string& path, const Parameters& parameters);

}  // namespace vantage
