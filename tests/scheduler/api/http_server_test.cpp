#include "scheduler/api/http_server.h"

#include <gtest/gtest.h>
#include <httplib.h>

#include "schema/base/error.h"
#include "schema/base/json.h"
#include "tests/scheduler/api/small_farm.h"

namespace vantage {
namespace {

class Server : public testing::Test {
 protected:
  Server()
      : server_("127.0.0.1:0", farm_.state_dir(),
                {.submit =
                     [this](SubmitRequest r) {
                       submitted_ = r;
                       return SubmitResult{ShotId{7}, 1, 12, 3};
                     },
                 .command =
                     [this](Command c) {
                       command_ = c;
                       return CommandResult{1, "1 job runs again"};
                     }}),
        http_(server_.url()) {}

  SmallFarm farm_;
  std::optional<SubmitRequest> submitted_;
  std::optional<Command> command_;
  HttpServer server_;
  httplib::Client http_;
  const httplib::Headers ours_{{"X-Vantage", "1"}};
};

TEST_F(Server, ServesThePageItself) {
  const auto page = http_.Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_NE(page->body.find("<script src=\"/app.js\">"), std::string::npos);
  EXPECT_GT(http_.Get("/app.js")->body.size(), 1000u);
}

TEST_F(Server, AnswersJsonAndJsonErrors) {
  EXPECT_EQ(Json::parse(http_.Get("/api/v1/shots")->body).at("shots").at(0).at("name"), "dance");
  const auto missing = http_.Get("/api/v1/jobs/999");
  EXPECT_EQ(missing->status, 404);
  EXPECT_EQ(Json::parse(missing->body).at("error"), "there is no job 999");
  EXPECT_EQ(http_.Get("/api/v1/shots/1/jobs?limit=x")->status, 400);
  EXPECT_EQ(http_.Get("/api/v1/nothing")->status, 404);
}

TEST_F(Server, ServesLogsWithTheirSizeAndFromAnOffset) {
  const auto log = http_.Get("/api/v1/jobs/6/log");
  EXPECT_EQ(log->body, "reading maps\nno edge with depth\n");
  EXPECT_EQ(log->get_header_value("X-Log-Size"), "32");
  EXPECT_EQ(http_.Get("/api/v1/jobs/6/log?offset=13")->body, "no edge with depth\n");
  EXPECT_EQ(http_.Get("/api/v1/jobs/6/log?tail=6")->body, "depth\n");
  EXPECT_EQ(http_.Get("/api/v1/jobs/1/log")->status, 404);
}

TEST_F(Server, ServesPreviewsAndPartsOfFilms) {
  const auto picture = http_.Get("/api/v1/jobs/4/preview");
  EXPECT_EQ(picture->get_header_value("Content-Type"), "image/svg+xml");
  EXPECT_EQ(http_.Get("/api/v1/jobs/6/preview")->status, 404);
  const auto part = http_.Get("/api/v1/shots/1/out/render/freeze/freeze.mp4", {httplib::make_range_header({{2, 4}})});
  EXPECT_EQ(part->status, 206);
  EXPECT_EQ(part->body, "234");
}

TEST_F(Server, KeepsToOutAndStore) {
  for (const char* path : {"/api/v1/shots/1/out/../shot.toml", "/api/v1/shots/1/out/../.vantage/secret.txt",
                           "/api/v1/shots/1/out/%2e%2e/shot.toml", "/api/v1/shots/1/.vantage/store/../secret.txt",
                           "/api/v1/shots/1/out//etc/passwd"})
    EXPECT_EQ(http_.Get(path)->status, 404) << path;
  std::filesystem::create_symlink("/etc", farm_.shot() / "out" / "away");
  EXPECT_EQ(http_.Get("/api/v1/shots/1/out/away/passwd")->status, 404);
  std::filesystem::create_symlink(farm_.shot() / ".vantage/store/align/e1/clocks.json",
                                  farm_.shot() / "out" / "clocks.json");
  EXPECT_EQ(http_.Get("/api/v1/shots/1/out/clocks.json")->status, 200);
}

TEST_F(Server, PassesOrdersToTheFarmOnlyWithOurHeader) {
  EXPECT_EQ(http_.Post("/api/v1/jobs/6/retry")->status, 400);
  EXPECT_FALSE(command_);
  const auto retried = http_.Post("/api/v1/jobs/6/retry", ours_, "", "application/json");
  EXPECT_EQ(Json::parse(retried->body).at("text"), "1 job runs again");
  ASSERT_TRUE(command_);
  EXPECT_EQ(command_->verb, Command::Verb::Retry);
  EXPECT_EQ(command_->job, JobId{6});
  EXPECT_EQ(http_.Post("/api/v1/jobs/6/explode", ours_, "", "application/json")->status, 404);
}

TEST_F(Server, TakesSubmissionsAndSaysWhatIsWrongWithThem) {
  EXPECT_EQ(http_.Post("/api/v1/shots", ours_, "{\"folder\": 3}", "application/json")->status, 400);
  const auto answer =
      http_.Post("/api/v1/shots", ours_, R"({"folder": "/shots/a", "until": "depth"})", "application/json");
  EXPECT_EQ(Json::parse(answer->body).at("shot"), 7);
  EXPECT_EQ(submitted_->until_kind, "depth");
}

TEST_F(Server, TellsEventStreamsThatTheDatabaseChanged) {
  int num_events = 0;
  http_.Get("/api/v1/events", [&](const char* data, std::size_t size) {
    if (std::string(data, size).find("event: changed") == std::string::npos) return true;
    if (++num_events == 1) farm_.db().run("UPDATE job SET progress = 0.9 WHERE id = 5");
    return num_events < 2;
  });
  EXPECT_EQ(num_events, 2);
}

TEST_F(Server, StaysAnswerableWhileManyStreamsAreOpen) {
  std::vector<std::jthread> streams;
  std::atomic<int> num_open{0};
  std::atomic<bool> enough{false};
  for (int i = 0; i < 30; ++i)
    streams.emplace_back([&] {
      httplib::Client client(server_.url());
      client.Get("/api/v1/events", [&, counted = false](const char*, std::size_t) mutable {
        if (!std::exchange(counted, true)) ++num_open;
        return !enough;
      });
    });
  while (num_open < 30) std::this_thread::yield();
  EXPECT_EQ(http_.Get("/api/v1/shots")->status, 200);
  enough = true;
  farm_.db().run("UPDATE job SET progress = 0.9 WHERE id = 5");
}

TEST(HttpServer, SaysWhenAnAddressCannotBeHad) {
  const SmallFarm farm;
  EXPECT_THROW(HttpServer("nonsense", farm.state_dir(), {}), Error);
  const HttpServer first("127.0.0.1:0", farm.state_dir(), {});
  EXPECT_THROW(HttpServer("127.0.0.1:99999", farm.state_dir(), {}), Error);
}

}  // namespace
}  // namespace vantage
