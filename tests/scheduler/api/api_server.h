#pragma once
#include <gtest/gtest.h>

#include <atomic>
#include <optional>

#include "scheduler/api/http_server.h"
#include "schema/base/json.h"
#include "tests/scheduler/api/small_farm.h"

namespace vantage {

/// A real server over a small farm's database; what it would ask of the farm is kept.
class ApiServer : public testing::Test {
 protected:
  explicit ApiServer(const HttpLimits& limits = {})
      : server_({.listen = "127.0.0.1:0", .state_dir = farm_.state_dir(), .control = control(), .limits = limits}),
        http_(server_.url()),
        token_(read_token_file(operator_token_file(farm_.state_dir()))),
        ours_{{"Authorization", "Bearer " + token_}} {}

  httplib::Result post(const std::string& path, const std::string& body = "") {
    return http_.Post(path, ours_, body, "application/json");
  }
  Json get(const std::string& path) { return Json::parse(http_.Get(path)->body); }

  SmallFarm farm_;
  std::optional<SubmitRequest> submitted_;
  std::optional<Command> command_;
  OnceKey once_;
  FarmState state_{};
  HttpServer server_;
  httplib::Client http_;
  std::string token_;
  httplib::Headers ours_;

 private:
  FarmControl control() {
    return {.submit =
                [this](SubmitRequest request, OnceKey once) {
                  once_ = once;
                  submitted_ = request;
                  return SubmitResult{ShotId{7}, 1, 12, 3};
                },
            .command =
                [this](Command command, OnceKey once) {
                  once_ = once;
                  command_ = command;
                  return CommandResult{1, "1 job runs again", {"depth/left-000000"}};
                },
            .state = [this] { return state_; }};
  }
};

}  // namespace vantage
