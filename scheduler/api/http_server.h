#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "scheduler/dispatch/command.h"
#include "scheduler/farm/farm.h"

namespace vantage {

/// What the server may ask the farm to change; each blocks until the farm has answered and throws what it throws.
struct FarmControl {
  std::function<SubmitResult(SubmitRequest)> submit;
  std::function<CommandResult(Command)> command;
};

/// The page and the API on one address. Reads go to the database through their own connections, writes to the farm.
///
///   GET  /                                      the page
///   GET  /api/v1/…                              see routes.h
///   GET  /api/v1/jobs/ID/log?attempt=&offset=&tail=   text; header X-Log-Size is the whole log's size
///   GET  /api/v1/jobs/ID/preview                a small picture
///   GET  /api/v1/shots/ID/out/PATH              a file below SHOT/out (ranges work: films can be wound)
///   GET  /api/v1/events                         server-sent event "changed" at most four times a second
///   POST /api/v1/shots                          {folder, until, priority}
///   POST /api/v1/jobs/ID/retry · /jobs/ID/cancel · /shots/ID/{pause,resume,cancel,retry}
///
/// Errors are {"error": "one line"} with 400, 404 or 500. A POST must carry the header X-Vantage, which other people's
/// web pages cannot send: a page open in the same browser must not be able to command the farm.
class HttpServer {
 public:
  /// listen: "127.0.0.1:8080"; port 0 takes any free one. Throws Error(BadInput) when the address cannot be had.
  HttpServer(const std::string& listen, std::filesystem::path state_dir, FarmControl control);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// "http://127.0.0.1:41234"
  const std::string& url() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vantage
