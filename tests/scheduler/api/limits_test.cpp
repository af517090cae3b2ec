// Real sockets that do what no honest client does.
#include <thread>

#include "tests/scheduler/api/api_server.h"
#include "tests/support/raw_client.h"

namespace vantage {
namespace {

using std::chrono::milliseconds;

class Limits : public ApiServer {
 protected:
  Limits()
      : ApiServer({.max_body_bytes = 10'000,
                   .max_head_bytes = 4'000,
                   .max_line_bytes = 2'000,
                   .max_connections = 12,
                   .max_per_address = 8,
                   .max_streams = 2,
                   .head_time = milliseconds(300),
                   .body_time = milliseconds(300),
                   .idle_time = milliseconds(600),
                   .write_time = milliseconds(300)}) {}

  std::string answer_to(const std::string& request) {
    RawClient client(server_.url());
    client.send(request);
    return client.receive_all();
  }
  std::string post_head(const std::string& more) const {
    return "POST /api/v1/shots HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer " + token_ +
           "\r\nContent-Type: application/json\r\n" + more + "\r\n";
  }
  static constexpr const char* kGet = "GET /api/v1/shots HTTP/1.1\r\nHost: localhost\r\n";
};

TEST_F(Limits, LongRequestLinesAre414) {
  EXPECT_EQ(status_of(answer_to("GET /" + std::string(3'000, 'a') + " HTTP/1.1\r\n\r\n")), 414);
}
TEST_F(Limits, LongHeadersAre431) {
  EXPECT_EQ(status_of(answer_to(kGet + ("X: " + std::string(3'000, 'a')) + "\r\n\r\n")), 431);
}
TEST_F(Limits, ManyHeadersAre431) {
  std::string head = kGet;
  for (int i = 0; i < 1000; ++i) head += "X: y\r\n";
  EXPECT_EQ(status_of(answer_to(head + "\r\n")), 431);
}
TEST_F(Limits, LargeBodiesAre413BeforeTheyAreSent) {
  EXPECT_EQ(status_of(answer_to(post_head("Content-Length: 10001\r\n"))), 413);
  EXPECT_EQ(status_of(answer_to(post_head("Content-Length: 99999999999\r\n"))), 413);
}
TEST_F(Limits, BodiesOfUnknownOrTwoSizesAreRefused) {
  EXPECT_EQ(status_of(answer_to(post_head("Transfer-Encoding: chunked\r\n"))), 411);
  EXPECT_EQ(status_of(answer_to(post_head("Content-Length: 2\r\nContent-Length: 3\r\n") + "{}")), 400);
  for (const char* size : {"-1", "1x", "", "0x10", "184467440737095516160"})
    EXPECT_EQ(status_of(answer_to(post_head("Content-Length: " + std::string(size) + "\r\n") + "{}")), 400) << size;
  EXPECT_FALSE(submitted_);
}
TEST_F(Limits, AHeadThatDripsIs408) {
  RawClient client(server_.url());
  const std::string request = kGet;
  for (std::size_t i = 0; i < request.size() && client.send(request.substr(i, 1)); ++i)
    std::this_thread::sleep_for(milliseconds(30));
  EXPECT_EQ(status_of(client.receive_all()), 408);
}
TEST_F(Limits, ABodyThatDoesNotComeEndsTheConnection) {
  RawClient client(server_.url());
  client.send(post_head("Content-Length: 100\r\n") + "{");
  EXPECT_TRUE(client.is_closed_within(3'000));
  EXPECT_FALSE(submitted_);
}
TEST_F(Limits, AnIdleConnectionIsClosed) {
  RawClient client(server_.url());
  client.send(std::string(kGet) + "\r\n");
  EXPECT_EQ(status_of(client.receive_until("}]}")), 200);
  EXPECT_TRUE(client.is_closed_within(3'000));
}
TEST_F(Limits, WhoMayNotNeedNotBeReadToTheEnd) {
  RawClient client(server_.url());
  client.send("POST /api/v1/shots HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9000\r\n\r\n");
  EXPECT_EQ(status_of(client.receive_until("}", 1'000)), 401);
}
TEST_F(Limits, APostWithoutABodyNeedsNoLength) {
  EXPECT_EQ(status_of(answer_to("POST /api/v1/jobs/6/retry HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
                                "Authorization: Bearer " +
                                token_ + "\r\n\r\n")),
            200);
  EXPECT_TRUE(command_);
}
TEST_F(Limits, SeveralRequestsMayComeInOnePiece) {
  const std::string one = post_head("Content-Length: 22\r\n") + R"({"folder": "/shots/a"})";
  const std::string text = answer_to(one + kGet + "Connection: close\r\n\r\n");
  EXPECT_EQ(status_of(text), 200);
  EXPECT_NE(text.find("HTTP/1.1 200", 5), std::string::npos) << text;
}
TEST_F(Limits, StreamsLeaveRoomForRequests) {
  std::vector<std::unique_ptr<RawClient>> streams;
  const std::string ask = "GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n";
  for (int i = 0; i < 2; ++i) {
    streams.push_back(std::make_unique<RawClient>(server_.url()));
    streams.back()->send(ask);
    EXPECT_EQ(status_of(streams.back()->receive_until("event: changed")), 200);
  }
  EXPECT_EQ(status_of(answer_to("GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")), 503);
  EXPECT_EQ(http_.Get("/api/v1/shots")->status, 200);
  streams.clear();
  int status = 0;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (status != 200 && std::chrono::steady_clock::now() < until) {
    RawClient next(server_.url());
    next.send(ask);
    status = status_of(next.receive_until("\r\n\r\n"));
  }
  EXPECT_EQ(status, 200) << "a stream whose client has gone makes room";
}
TEST_F(Limits, OthersAreServedWhileSomeAreSlow) {
  std::vector<std::unique_ptr<RawClient>> slow;
  for (int i = 0; i < 6; ++i) {
    slow.push_back(std::make_unique<RawClient>(server_.url()));
    slow.back()->send("GET /api/v1/sh");
  }
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 20; ++i) EXPECT_EQ(http_.Get("/api/v1/shots")->status, 200);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
}
TEST_F(Limits, ManyRangesAreRefused) {
  httplib::Ranges ranges(5, {0, 1});
  EXPECT_EQ(http_.Get("/api/v1/shots/1/out/render/freeze/freeze.mp4", {httplib::make_range_header(ranges)})->status,
            416);
}

class FewConnections : public ApiServer {
 protected:
  FewConnections() : ApiServer({.max_connections = 3, .max_per_address = 100, .idle_time = milliseconds(400)}) {}
};

TEST_F(FewConnections, TooManyTogetherAre503AndRoomComesBack) {
  std::vector<std::unique_ptr<RawClient>> idle;
  for (int i = 0; i < 3; ++i) idle.push_back(std::make_unique<RawClient>(server_.url()));
  int status = 0;
  for (int tries = 0; status != 503 && tries < 50; ++tries) {
    RawClient next(server_.url());
    status = status_of(next.receive_all(100));
  }
  EXPECT_EQ(status, 503);
  idle.clear();
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while (status != 200 && std::chrono::steady_clock::now() < until) {
    const auto answer = httplib::Client(server_.url()).Get("/api/v1/shots");
    status = answer ? answer->status : 0;
  }
  EXPECT_EQ(status, 200);
}

class FewOfOneAddress : public ApiServer {
 protected:
  FewOfOneAddress() : ApiServer({.max_per_address = 2}) {}
};

TEST_F(FewOfOneAddress, OneAddressCannotTakeAllConnections) {
  const RawClient first(server_.url()), second(server_.url());
  int status = 0;
  for (int tries = 0; status != 429 && tries < 50; ++tries)
    status = status_of(RawClient(server_.url()).receive_all(100));
  EXPECT_EQ(status, 429);
}

}  // namespace
}  // namespace vantage
