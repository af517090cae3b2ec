#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "scheduler/api/handlers.h"
#include "scheduler/api/limits.h"

namespace vantage {

/// The page and the API on one address. Reads go to the database through their own connections, writes to the farm.
/// What there is to ask: openapi.json, one line per route in route_table.cpp. Who may ask: gate.h. How much: limits.h.
/// Errors are {"error": "one line"}.
class HttpServer {
 public:
  struct Options {
    std::string listen;  ///< "127.0.0.1:8080"; port 0 takes any free one
    std::filesystem::path state_dir;
    FarmControl control;
    HttpLimits limits{};
  };
  /// Throws Error(BadInput) when the address cannot be had or the tokens cannot be read.
  explicit HttpServer(Options options);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// "http://127.0.0.1:41234"
  const std::string& url() const;
  /// url() for a person's browser: with the token that lets the page command the farm, after '#', where it reaches no
  /// log and no other server. Without it when farm.toml hands out the tokens.
  std::string page_url() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// The farm itself as what the server may ask of it.
FarmControl control_of(FarmScheduler& farm);

}  // namespace vantage
