#pragma once
/// The broker's side of one connection. Private to broker.cpp and its tests.
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vantage {

/// A publication as it goes over the wire, shared by all clients that are to get it.
using Frame = std::shared_ptr<const std::string>;

/// Whether a channel's name fits a subscription. Of LCM's regular expressions only literals, '.' and '.*' are
/// understood, matched against the whole name: anyone may connect, and a general expression may take for ever.
bool channel_matches(std::string_view pattern, std::string_view channel);

/// Frames that wait for a slow reader, oldest first.
class FrameQueue {
 public:
  explicit FrameQueue(std::size_t max_bytes) : max_bytes_(max_bytes) {}
  /// Makes room by dropping the oldest frames that are not half written; returns how many.
  std::int64_t push(Frame frame);
  /// Writes what the socket takes, one call per frame. False when the connection is broken.
  bool write_to(int fd);
  bool empty() const { return frames_.empty(); }

 private:
  std::deque<Frame> frames_;
  std::size_t num_bytes_ = 0, max_bytes_;
  std::size_t num_head_bytes_written_ = 0;
};

/// Takes apart what a client sends: LCM's tcpq protocol, all numbers 32 bit big-endian.
///   hello        0x287617fb, version; answered by 0x287617fa, version
///   publish      1, length, channel, length, data; relayed as it is
///   subscribe    2, length, pattern; unsubscribe 3, length, pattern
class TcpqParser {
 public:
  struct Publish {
    std::string channel;
    Frame frame;
  };
  struct Events {
    std::function<void()> on_hello;
    std::function<void(Publish)> on_publish;
  };
  explicit TcpqParser(Events events) : events_(std::move(events)) {}
  /// False when this is no client of ours, or it sends something absurd: close the connection.
  bool feed(std::string_view bytes);
  bool wants(std::string_view channel) const;
  bool said_hello() const { return said_hello_; }

 private:
  /// Bytes used by one message at the front; 0 = not all there yet; nothing = nonsense.
  std::optional<std::size_t> parse_one(std::string_view in);
  std::optional<std::size_t> parse_hello(std::string_view in);
  std::optional<std::size_t> parse_publish(std::string_view in);

  Events events_;
  std::string pending_;
  bool said_hello_ = false;
  std::vector<std::string> patterns_;
};

/// The bytes that answer a hello.
Frame server_hello();

}  // namespace vantage
