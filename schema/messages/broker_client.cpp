#include "schema/messages/broker_client.h"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>

namespace vantage {
namespace {

constexpr std::uint32_t kClientMagic = 0x287617fb, kServerMagic = 0x287617fa, kVersion = 0x0100;
constexpr std::uint32_t kPublish = 1, kSubscribe = 2, kUnsubscribe = 3;
constexpr std::size_t kMaxNameBytes = 255;        // LCM's own limit is 63; patterns may be longer
constexpr std::size_t kMaxDataBytes = 1U << 20U;  // ours are at most 60,000
constexpr std::size_t kMaxPatterns = 64;

std::uint32_t number_at(std::string_view in, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = at; i < at + 4; ++i) value = value << 8U | static_cast<unsigned char>(in[i]);
  return value;
}

std::string number(std::uint32_t value) {
  std::string out;
  for (const unsigned shift : {24U, 16U, 8U, 0U}) out += static_cast<char>(value >> shift & 0xFFU);
  return out;
}

}  // namespace

bool channel_matches(std::string_view pattern, std::string_view channel) {
  std::size_t p = 0, c = 0;
  std::size_t after_star = std::string_view::npos, star_c = 0;  // where to go on when the last '.*' must take one more
  while (c < channel.size() || p < pattern.size()) {
    if (pattern.substr(p, 2) == ".*") {
      after_star = p += 2;
      star_c = c;
    } else if (p < pattern.size() && c < channel.size() && (pattern[p] == '.' || pattern[p] == channel[c])) {
      ++p;
      ++c;
    } else if (after_star != std::string_view::npos && star_c < channel.size()) {
      p = after_star;
      c = ++star_c;
    } else {
      return false;
    }
  }
  return true;
}

std::int64_t FrameQueue::push(Frame frame) {
  num_bytes_ += frame->size();
  frames_.push_back(std::move(frame));
  std::int64_t num_dropped = 0;
  const std::ptrdiff_t first = num_head_bytes_written_ > 0 ? 1 : 0;
  while (num_bytes_ > max_bytes_ && std::ssize(frames_) > first + 1) {
    num_bytes_ -= frames_[static_cast<std::size_t>(first)]->size();
    frames_.erase(frames_.begin() + first);
    ++num_dropped;
  }
  return num_dropped;
}

bool FrameQueue::write_to(int fd) {
  while (!frames_.empty()) {
    const std::string_view rest = std::string_view(*frames_.front()).substr(num_head_bytes_written_);
    const ssize_t n = send(fd, rest.data(), rest.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
    num_head_bytes_written_ += static_cast<std::size_t>(n);
    if (num_head_bytes_written_ < frames_.front()->size()) continue;
    num_bytes_ -= frames_.front()->size();
    num_head_bytes_written_ = 0;
    frames_.pop_front();
  }
  return true;
}

bool TcpqParser::feed(std::string_view bytes) {
  pending_ += bytes;
  std::size_t used = 0;
  while (used < pending_.size()) {
    const auto n = parse_one(std::string_view(pending_).substr(used));
    if (!n) return false;
    if (*n == 0) break;
    used += *n;
  }
  pending_.erase(0, used);
  return true;
}

bool TcpqParser::wants(std::string_view channel) const {
  return std::any_of(patterns_.begin(), patterns_.end(),
                     [&](const std::string& p) { return channel_matches(p, channel); });
}

std::optional<std::size_t> TcpqParser::parse_hello(std::string_view in) {
  if (in.size() < 8) return 0;
  if (number_at(in, 0) != kClientMagic || number_at(in, 4) != kVersion) return std::nullopt;
  said_hello_ = true;
  events_.on_hello();
  return 8;
}

std::optional<std::size_t> TcpqParser::parse_one(std::string_view in) {
  if (!said_hello_) return parse_hello(in);
  if (in.size() < 8) return 0;
  const std::uint32_t type = number_at(in, 0);
  const std::size_t name_bytes = number_at(in, 4);
  if (type < kPublish || type > kUnsubscribe || name_bytes > kMaxNameBytes) return std::nullopt;
  if (in.size() < 8 + name_bytes) return 0;
  if (type == kPublish) return parse_publish(in);
  std::string pattern(in.substr(8, name_bytes));
  if (type == kUnsubscribe)
    std::erase(patterns_, pattern);
  else if (patterns_.size() >= kMaxPatterns)
    return std::nullopt;
  else
    patterns_.push_back(std::move(pattern));
  return 8 + name_bytes;
}

std::optional<std::size_t> TcpqParser::parse_publish(std::string_view in) {
  const std::size_t name_bytes = number_at(in, 4);
  const std::size_t data_at = 8 + name_bytes + 4;
  if (in.size() < data_at) return 0;
  const std::size_t data_bytes = number_at(in, data_at - 4);
  if (data_bytes > kMaxDataBytes) return std::nullopt;
  if (in.size() < data_at + data_bytes) return 0;
  const std::string_view frame = in.substr(0, data_at + data_bytes);
  events_.on_publish({std::string(in.substr(8, name_bytes)), std::make_shared<const std::string>(frame)});
  return frame.size();
}

Frame server_hello() { return std::make_shared<const std::string>(number(kServerMagic) + number(kVersion)); }

}  // namespace vantage
