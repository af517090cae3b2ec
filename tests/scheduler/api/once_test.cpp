// Orders that come twice, to a real farm: the answer got lost, or the scheduler was restarted meanwhile.
#include <gtest/gtest.h>

#include "scheduler/api/http_server.h"
#include "schema/base/files.h"
#include "schema/base/json.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

class Once : public testing::Test {
 protected:
  Once() {
    fs::create_directories(shot());
    write_file_atomically(shot() / "a.mp4", "a");
    write_file_atomically(shot() / "b.mp4", "b");
    write_file_atomically(shot() / "shot.toml",
                          "[shot]\nname = \"s\"\n[[camera]]\nname = \"a\"\nfootage = \"a.mp4\"\n"
                          "[[camera]]\nname = \"b\"\nfootage = \"b.mp4\"\n");
    start();
  }
  fs::path shot() const { return folder_.path() / "shot"; }
  void start() {
    server_.reset();
    farm_.reset();
    FarmScheduler::Options options;
    options.state_dir = folder_.path() / "farm";
    farm_ = std::make_unique<FarmScheduler>(options);
    server_ = std::make_unique<HttpServer>(
        HttpServer::Options{.listen = "127.0.0.1:0", .state_dir = options.state_dir, .control = control_of(*farm_)});
  }
  httplib::Result submit(const std::string& key, int priority = 0) {
    const httplib::Headers headers{
        {"Authorization", "Bearer " + read_token_file(operator_token_file(farm_->state_dir()))},
        {"Idempotency-Key", key}};
    const Json body{{"folder", shot().string()}, {"until", "ingest"}, {"priority", priority}};
    return httplib::Client(server_->url()).Post("/api/v1/shots", headers, body.dump(), "application/json");
  }
  std::int64_t generation(const httplib::Result& answer) { return Json::parse(answer->body).at("generation"); }

  TemporaryFolder folder_;
  std::unique_ptr<FarmScheduler> farm_;
  std::unique_ptr<HttpServer> server_;
};

TEST_F(Once, TheSameKeyIsCarriedOutOnceAndAnsweredAlikeAlsoAfterARestart) {
  const auto first = submit("k1");
  ASSERT_EQ(first->status, 200) << first->body;
  EXPECT_EQ(submit("k1")->body, first->body);
  start();
  EXPECT_EQ(submit("k1")->body, first->body);
  EXPECT_EQ(generation(submit("k2")), 2) << "another key is another order";
}

TEST_F(Once, TheSameKeyWithAnotherRequestIsRefused) {
  ASSERT_EQ(submit("k1")->status, 200);
  const auto other = submit("k1", 5);
  EXPECT_EQ(other->status, 422);
  EXPECT_NE(other->body.find("Idempotency-Key 'k1'"), std::string::npos) << other->body;
  EXPECT_EQ(generation(submit("k2")), 2) << "nothing was done";
}

TEST_F(Once, WhatFailedMayBeTriedAgainWithTheSameKey) {
  fs::rename(shot() / "shot.toml", shot() / "aside.toml");
  EXPECT_EQ(submit("k1")->status, 400);
  fs::rename(shot() / "aside.toml", shot() / "shot.toml");
  EXPECT_EQ(submit("k1")->status, 200);
}

TEST_F(Once, WithoutAKeyEveryOrderIsCarriedOut) {
  EXPECT_EQ(generation(submit("")), 1);
  EXPECT_EQ(generation(submit("")), 2);
}

TEST_F(Once, WhoAskedStandsInTheAuditLog) {
  submit("k1");
  const Json events = Json::parse(httplib::Client(server_->url()).Get("/api/v1/audit")->body).at("events");
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events.back().at("kind"), "submitted");
  EXPECT_EQ(events.back().at("who"), "operator");
}

}  // namespace
}  // namespace vantage
