#include "schema/messages/broker.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "schema/base/error.h"
#include "schema/messages/broker_client.h"
#include "tests/schema/messages/messages_support.h"

namespace vantage {
namespace {

std::string number(std::uint32_t value) {
  std::string out(4, '\0');
  for (std::size_t i = 0; i < 4; ++i) out[i] = static_cast<char>(value >> (24 - 8 * i));
  return out;
}
std::string text(const std::string& s) { return number(static_cast<std::uint32_t>(s.size())) + s; }
std::string hello() { return number(0x287617fb) + number(0x0100); }
std::string publish(const std::string& channel, const std::string& data) {
  return number(1) + text(channel) + text(data);
}

/// A client with no LCM in it: what is on the wire is what the test says.
class RawClient {
 public:
  explicit RawClient(std::uint16_t port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const timeval patience{.tv_sec = 5, .tv_usec = 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  ~RawClient() { close(fd_); }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  void say(const std::string& bytes) {
    EXPECT_EQ(send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL), std::ssize(bytes));
  }
  /// Exactly n bytes, fewer when the broker hangs up.
  std::string hear(std::size_t n) {
    std::string out(n, '\0');
    std::size_t have = 0;
    while (have < n) {
      const ssize_t got = recv(fd_, out.data() + have, n - have, 0);
      if (got <= 0) break;
      have += static_cast<std::size_t>(got);
    }
    out.resize(have);
    return out;
  }

 private:
  int fd_;
};

TEST(Broker, RelaysToSubscribersAndOnlyToThem) {
  Broker broker({});
  RawClient client(broker.port());
  client.say(hello());
  EXPECT_EQ(client.hear(8), number(0x287617fa) + number(0x0100));
  const std::string wanted = publish("NEWS", "two");
  client.say(number(2) + text("NEWS") + publish("OTHER", "one") + wanted);
  EXPECT_EQ(client.hear(wanted.size()), wanted);
}

TEST(Broker, MessagesInSmallPiecesAreRelayedWhole) {
  Broker broker({});
  RawClient client(broker.port());
  const std::string message = publish("NEWS", "in pieces");
  for (const char c : hello() + number(2) + text("NEWS") + message) client.say(std::string(1, c));
  client.hear(8);
  EXPECT_EQ(client.hear(message.size()), message);
}

TEST(Broker, UnsubscribedClientHearsNoMore) {
  Broker broker({});
  RawClient client(broker.port());
  const std::string last = publish("B", "end");
  client.say(hello() + number(2) + text("A") + number(2) + text("B") + number(3) + text("A") + publish("A", "x") +
             last);
  client.hear(8);
  EXPECT_EQ(client.hear(last.size()), last);
}

TEST(Broker, HangsUpOnNonsense) {
  Broker broker({});
  for (const std::string& nonsense :
       {std::string("GET / HTTP/1.1\r\n\r\n"), hello() + number(9) + text("A"), hello() + number(1) + number(100'000),
        hello() + number(1) + text("A") + number(0x7fffffff)}) {
    RawClient client(broker.port());
    client.say(nonsense);
    EXPECT_LE(client.hear(100).size(), 8U);
  }
  EXPECT_TRUE(eventually([&] { return broker.counts().num_clients == 0; }));
}

TEST(Broker, ClientThatDoesNotReadLosesMessagesAndStopsNobody) {
  Broker broker({.max_queue_bytes_per_client = 100'000});
  RawClient sleeper(broker.port());
  sleeper.say(hello() + number(2) + text("NEWS"));
  RawClient reader(broker.port());
  reader.say(hello() + number(2) + text("NEWS"));
  sleeper.hear(8);
  reader.hear(8);
  const std::string message = publish("NEWS", std::string(50'000, 'x'));
  for (int i = 0; i < 400; ++i) {
    reader.say(message);
    ASSERT_EQ(reader.hear(message.size()), message);
  }
  EXPECT_GT(broker.counts().num_dropped, 0);
}

TEST(Broker, PortThatIsTakenIsBadInput) {
  const Broker broker({});
  EXPECT_THROW(Broker({.port = broker.port()}), Error);
  EXPECT_THROW(Broker({.host = "localhost.invalid"}), Error);
}

TEST(Broker, PatternsMatchWholeNames) {
  EXPECT_TRUE(channel_matches("NEWS", "NEWS"));
  EXPECT_FALSE(channel_matches("NEWS", "NEWS_2"));
  EXPECT_FALSE(channel_matches("NEWS_2", "NEWS"));
  EXPECT_TRUE(channel_matches(".*", "anything"));
  EXPECT_TRUE(channel_matches(".*", ""));
  EXPECT_TRUE(channel_matches("A.*B.*C", "AxxBxBC"));
  EXPECT_FALSE(channel_matches("A.*B.*C", "AxxBxBCd"));
  EXPECT_TRUE(channel_matches("A.C", "ABC"));
  EXPECT_FALSE(channel_matches("A.C", "AC"));
}

TEST(FrameQueue, DropsTheOldestButNeverAHalfWrittenOne) {
  int fds[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, fds), 0);
  FrameQueue queue(3'000'000);
  const auto frame = [](char c, std::size_t n) { return std::make_shared<const std::string>(n, c); };
  EXPECT_EQ(queue.push(frame('a', 2'000'000)), 0);
  ASSERT_TRUE(queue.write_to(fds[0]));
  ASSERT_FALSE(queue.empty()) << "the socket cannot take 2 MB at once";
  EXPECT_EQ(queue.push(frame('b', 900'000)), 0);
  EXPECT_EQ(queue.push(frame('c', 900'000)), 1);
  std::string heard;
  std::vector<char> buffer(1U << 20U);
  while (!queue.empty()) {
    heard.append(buffer.data(), static_cast<std::size_t>(read(fds[1], buffer.data(), buffer.size())));
    ASSERT_TRUE(queue.write_to(fds[0]));
  }
  for (ssize_t n = 0; (n = recv(fds[1], buffer.data(), buffer.size(), MSG_DONTWAIT)) > 0;)
    heard.append(buffer.data(), static_cast<std::size_t>(n));
  EXPECT_EQ(heard, std::string(2'000'000, 'a') + std::string(900'000, 'c'));
  close(fds[0]);
  close(fds[1]);
}

TEST(Broker, ClientThatDoesNotSayWhatItIsIsCutOff) {
  const Broker broker({.hello_within_ms = 50});
  RawClient silent(broker.port());
  EXPECT_EQ(silent.hear(1), "") << "the broker hangs up";
  EXPECT_EQ(broker.counts().num_silent, 1);
}

TEST(Broker, NoMoreClientsThanAllowed) {
  const Broker broker({.max_clients = 1});
  RawClient first(broker.port());
  first.say(hello());
  EXPECT_EQ(first.hear(8).size(), 8U);
  RawClient second(broker.port());
  EXPECT_EQ(second.hear(1), "");
  EXPECT_EQ(broker.counts().num_refused, 1);
}

TEST(Broker, ClientThatFloodsIsCutOff) {
  const Broker broker({.max_bytes_per_s_per_client = 10'000});
  RawClient client(broker.port());
  client.say(hello());
  EXPECT_EQ(client.hear(8).size(), 8U);
  client.say(publish("A", std::string(20'000, 'x')));
  EXPECT_EQ(client.hear(1), "");
  EXPECT_EQ(broker.counts().num_too_fast, 1);
}

TEST(Broker, NonsenseIsCountedAsSuch) {
  const Broker broker({});
  RawClient client(broker.port());
  client.say("GET / HTTP/1.1\r\n\r\n");
  EXPECT_EQ(client.hear(1), "");
  EXPECT_EQ(broker.counts().num_nonsense, 1);
}

TEST(Broker, WithoutDescriptorsConnectionsAreRefusedAndThereIsNoSpin) {
  const Broker broker({});
  RawClient client(broker.port());
  client.say(hello());
  EXPECT_EQ(client.hear(8).size(), 8U);
  const int client_fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(broker.port());
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::vector<int> hoard;
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit low{.rlim_cur = 64, .rlim_max = before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &low);
  for (int fd = 0; (fd = dup(client_fd)) >= 0;) hoard.push_back(fd);
  EXPECT_EQ(connect(client_fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_TRUE(eventually([&] { return broker.counts().num_refused == 1; }));
  for (const int fd : hoard) close(fd);
  setrlimit(RLIMIT_NOFILE, &before);
  close(client_fd);
  client.say(number(2) + text("A") + publish("A", "still there"));
  EXPECT_EQ(client.hear(publish("A", "still there").size()), publish("A", "still there"));
}

}  // namespace
}  // namespace vantage
