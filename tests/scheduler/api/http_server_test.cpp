#include "scheduler/api/http_server.h"

#include <thread>

#include "schema/base/error.h"
#include "tests/scheduler/api/api_server.h"

namespace vantage {
namespace {

class Server : public ApiServer {};

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

TEST_F(Server, PassesOrdersToTheFarm) {
  const auto retried = post("/api/v1/jobs/6/retry");
  EXPECT_EQ(Json::parse(retried->body).at("text"), "1 job runs again");
  ASSERT_TRUE(command_);
  EXPECT_EQ(command_->verb, Command::Verb::Retry);
  EXPECT_EQ(command_->job, JobId{6});
  EXPECT_EQ(post("/api/v1/shots/1/priority", R"({"priority": -3})")->status, 200);
  EXPECT_EQ(command_->shot, ShotId{1});
  EXPECT_EQ(command_->priority, -3);
  EXPECT_EQ(post("/api/v1/workers/w1/drain")->status, 200);
  EXPECT_EQ(command_->worker, "w1");
}

TEST_F(Server, SaysWhichActionsThereAre) {
  const auto answer = post("/api/v1/jobs/6/retyr");
  EXPECT_EQ(answer->status, 404);
  EXPECT_NE(answer->body.find("did you mean 'retry'?"), std::string::npos) << answer->body;
  EXPECT_FALSE(command_);
}

TEST_F(Server, SaysWhichMethodsAPathTakes) {
  const auto answer = http_.Delete("/api/v1/shots");
  EXPECT_EQ(answer->status, 405);
  EXPECT_EQ(answer->get_header_value("Allow"), "GET, POST");
  EXPECT_EQ(http_.Get("/api/v1/shots/1/retry")->status, 405);
  EXPECT_EQ(http_.Head("/api/v1/shots")->status, 200);
}

TEST_F(Server, TakesSubmissionsAndSaysWhatIsWrongWithThem) {
  for (const char* body : {"{\"folder\": 3}", "{\"folder\": \"relative\"}", "[]", "{", "3",
                           R"({"folder": "/shots/a", "priority": "high"})", R"({"folder": "/shots/a", "until": null})"})
    EXPECT_EQ(post("/api/v1/shots", body)->status, 400) << body;
  EXPECT_EQ(http_.Post("/api/v1/shots", ours_, "folder=/x", "application/x-www-form-urlencoded")->status, 415);
  EXPECT_FALSE(submitted_);
  const auto answer = post("/api/v1/shots", R"({"folder": "/shots/a", "until": "depth"})");
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

TEST_F(Server, StreamsGoOnWhereTheyWereCutOff) {
  for (int i = 0; i < 3; ++i)
    farm_.db().run("INSERT INTO event (at_ms, shot_id, kind, text) VALUES (5, 1, 'note', ?)", i);
  std::string text;
  http_.Get("/api/v1/events", {{"Last-Event-ID", "2"}}, [&](const char* data, std::size_t size) {
    text.append(data, size);
    return text.find("\n\n") == std::string::npos;
  });
  EXPECT_TRUE(text.starts_with("id: 4\nevent: changed\n")) << text;
  const Json data = Json::parse(text.substr(text.find("data: ") + 6));
  EXPECT_FALSE(data.at("behind"));
  ASSERT_EQ(data.at("events").size(), 2u);
  EXPECT_EQ(data.at("events").at(0).at("text"), "1");
}

TEST_F(Server, StreamsSayWhenTooMuchHasHappened) {
  for (int i = 0; i < 300; ++i)
    farm_.db().run("INSERT INTO event (at_ms, shot_id, kind, text) VALUES (5, 1, 'note', '')");
  std::string text;
  http_.Get("/api/v1/events", {{"Last-Event-ID", "1"}}, [&](const char* data, std::size_t size) {
    text.append(data, size);
    return text.find("\n\n") == std::string::npos;
  });
  EXPECT_NE(text.find("\"behind\":true"), std::string::npos) << text;
  EXPECT_TRUE(text.starts_with("id: 301\n")) << text;
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
  const auto serve = [&](const std::string& listen) {
    const HttpServer server({.listen = listen, .state_dir = farm.state_dir(), .control = {}});
    EXPECT_THROW(HttpServer({.listen = server.url().substr(7), .state_dir = farm.state_dir(), .control = {}}), Error);
  };
  EXPECT_THROW(serve("nonsense"), Error);
  EXPECT_THROW(serve("127.0.0.1:99999"), Error);
  serve("127.0.0.1:0");
}

}  // namespace
}  // namespace vantage
