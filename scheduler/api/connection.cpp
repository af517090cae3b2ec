#include "scheduler/api/connection.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <charconv>

#include "schema/base/json.h"

namespace vantage {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kBeat = std::chrono::milliseconds(100);
constexpr auto kLingerTime = std::chrono::milliseconds(300);
constexpr std::size_t kReceiveBytes = 16'384;
constexpr std::string_view kEndOfHead = "\r\n\r\n";

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
  return first == std::string_view::npos ? std::string_view() : text.substr(first, last - first + 1);
}

std::optional<EarlyAnswer> check_header(std::string_view line, bool& has_length, RequestHead& head) {
  const auto colon = line.find(':');
  if (colon == std::string_view::npos || colon == 0 || line[colon - 1] == ' ' || line[0] == ' ' || line[0] == '\t')
    return EarlyAnswer{400, "a header line must be NAME: VALUE"};
  const std::string name = lower(line.substr(0, colon));
  if (name == "transfer-encoding") return EarlyAnswer{411, "a body needs a Content-Length; chunks are not taken"};
  if (name != "content-length") return std::nullopt;
  const std::string_view value = trimmed(line.substr(colon + 1));
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), head.body_bytes);
  if (error != std::errc{} || end != value.data() + value.size() || std::exchange(has_length, true))
    return EarlyAnswer{400, "expected one Content-Length: a number of bytes"};
  return std::nullopt;
}

std::string_view reason_of(int status) {
  switch (status) {
    case 400:
      return "Bad Request";
    case 408:
      return "Request Timeout";
    case 411:
      return "Length Required";
    case 413:
      return "Payload Too Large";
    case 414:
      return "URI Too Long";
    case 429:
      return "Too Many Requests";
    case 431:
      return "Request Header Fields Too Large";
    default:
      return "Service Unavailable";
  }
}

std::string numeric_host(const sockaddr_storage& address, socklen_t size, int* port) {
  char host[NI_MAXHOST] = "", service[NI_MAXSERV] = "";
  if (getnameinfo(reinterpret_cast<const sockaddr*>(&address), size, host, sizeof host, service, sizeof service,
                  NI_NUMERICHOST | NI_NUMERICSERV) != 0)
    return {};
  if (port != nullptr) *port = std::atoi(service);
  const std::string text = host;
  return text.starts_with("::ffff:") ? text.substr(7) : text;
}

std::string peer(int socket, int* port) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  return getpeername(socket, reinterpret_cast<sockaddr*>(&address), &size) == 0 ? numeric_host(address, size, port)
                                                                                : "";
}

std::string self(int socket, int* port) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  return getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) == 0 ? numeric_host(address, size, port)
                                                                                : "";
}

}  // namespace

std::optional<EarlyAnswer> check_lines(std::string_view text, const HttpLimits& limits) {
  for (bool is_first = true; !text.empty(); is_first = false) {
    const auto end = text.find("\r\n");
    if (std::min(end, text.size()) > limits.max_line_bytes)
      return is_first ? EarlyAnswer{414, fmt::format("a request line of more than {} bytes", limits.max_line_bytes)}
                      : EarlyAnswer{431, fmt::format("a header of more than {} bytes", limits.max_line_bytes)};
    if (end == std::string_view::npos) break;
    text.remove_prefix(end + 2);
  }
  return std::nullopt;
}

std::optional<EarlyAnswer> check_head(std::string_view text, const HttpLimits& limits, RequestHead& head) {
  head = {};
  bool has_length = false;
  text.remove_prefix(std::min(text.find("\r\n"), text.size() - 2) + 2);  // the request line is httplib's to read
  for (auto end = text.find("\r\n"); end != 0 && end != std::string_view::npos; end = text.find("\r\n")) {
    if (auto answer = check_header(text.substr(0, end), has_length, head)) return answer;
    text.remove_prefix(end + 2);
  }
  if (head.body_bytes > limits.max_body_bytes)
    return EarlyAnswer{413,
                       fmt::format("a body of {} bytes; at most {} are taken", head.body_bytes, limits.max_body_bytes)};
  return std::nullopt;
}

std::string early_answer_text(const EarlyAnswer& answer) {
  const std::string body = Json{{"error", answer.why}}.dump();
  return fmt::format(
      "HTTP/1.1 {} {}\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}",
      answer.status, reason_of(answer.status), body.size(), body);
}

Connection::Connection(int socket, const HttpLimits& limits, const std::atomic<bool>& stopping)
    : socket_(socket), limits_(limits), stopping_(stopping) {}

Connection::Next Connection::await_request() {
  buffer_.erase(0, position_);
  position_ = 0;
  if (buffer_.empty() && receive(Clock::now() + limits_.idle_time) != Got::Bytes) return Next::Closed;
  const Time until = Clock::now() + limits_.head_time;
  std::size_t end = 0;
  while ((end = buffer_.find(kEndOfHead)) == std::string::npos && buffer_.size() <= limits_.max_head_bytes) {
    const Got got = receive(until);
    if (got == Got::End) return Next::Closed;
    if (got == Got::Late && stopping_) return Next::Closed;
    if (got == Got::Late) return refuse({408, "the request did not come in time"}), Next::Refused;
  }
  const bool whole = end != std::string::npos && end + kEndOfHead.size() <= limits_.max_head_bytes;
  const std::string_view text = std::string_view(buffer_).substr(0, whole ? end + kEndOfHead.size() : buffer_.size());
  RequestHead head;
  auto answer = check_lines(text, limits_);
  if (!answer && !whole)
    answer = EarlyAnswer{431, fmt::format("headers of more than {} bytes", limits_.max_head_bytes)};
  if (!answer) answer = check_head(text, limits_, head);
  if (answer) return refuse(*answer), Next::Refused;
  head_left_ = end + kEndOfHead.size();
  body_left_ = head.body_bytes;
  body_until_ = Clock::now() + limits_.body_time;
  return Next::Request;
}

void Connection::refuse(const EarlyAnswer& answer) {
  const std::string text = early_answer_text(answer);
  write(text.data(), text.size());
  linger();
}

void Connection::linger() {
  shutdown(socket_, SHUT_WR);
  const Time until = Clock::now() + kLingerTime;
  for (std::size_t num_bytes = 0; num_bytes < limits_.max_body_bytes; num_bytes += buffer_.size()) {
    buffer_.clear();
    if (receive(until) != Got::Bytes) return;
  }
}

bool Connection::wait_for(short events, Time until) const {
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now());
    pollfd fd{socket_, events, 0};
    if (poll(&fd, 1, static_cast<int>(std::clamp<std::int64_t>(left.count(), 0, kBeat.count()))) > 0) return true;
    if (left.count() <= 0 || stopping_) return false;
  }
}

/// More bytes at the buffer's end.
Connection::Got Connection::receive(Time until) {
  if (!wait_for(POLLIN, until)) return Got::Late;
  const std::size_t had = buffer_.size();
  buffer_.resize(had + kReceiveBytes);
  const ssize_t n = recv(socket_, buffer_.data() + had, kReceiveBytes, 0);
  buffer_.resize(had + static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
  return n > 0 ? Got::Bytes : Got::End;
}

bool Connection::is_readable() const { return head_left_ > 0 || body_left_ > 0; }

/// False once the client is gone: streams ask this between two events.
bool Connection::is_writable() const {
  pollfd fd{socket_, POLLOUT | POLLRDHUP, 0};
  return poll(&fd, 1, 0) > 0 && (fd.revents & (POLLERR | POLLHUP | POLLRDHUP | POLLNVAL)) == 0;
}

ssize_t Connection::read(char* bytes, size_t size) {
  if (head_left_ == 0) {
    if (body_left_ == 0) return 0;
    if (position_ == buffer_.size() && receive(body_until_) != Got::Bytes) return -1;
  }
  const std::uint64_t allowed = head_left_ > 0 ? head_left_ : body_left_;
  const auto n = static_cast<std::size_t>(std::min<std::uint64_t>({size, buffer_.size() - position_, allowed}));
  std::copy_n(buffer_.data() + position_, n, bytes);
  position_ += n;
  if (head_left_ > 0)
    head_left_ -= n;
  else
    body_left_ -= n;
  return static_cast<ssize_t>(n);
}

ssize_t Connection::write(const char* bytes, size_t size) {
  if (!wait_for(POLLOUT, Clock::now() + limits_.write_time)) return -1;
  return send(socket_, bytes, size, MSG_NOSIGNAL | MSG_DONTWAIT);
}

void Connection::get_remote_ip_and_port(std::string& ip, int& port) const { ip = peer(socket_, &port); }
void Connection::get_local_ip_and_port(std::string& ip, int& port) const { ip = self(socket_, &port); }

std::string address_of_peer(int socket) { return peer(socket, nullptr); }
std::string address_of_self(int socket) { return self(socket, nullptr); }
bool is_loopback(const std::string& ip) {
  in_addr address{};  // a name may begin with 127. as well
  return ip == "::1" || (ip.starts_with("127.") && inet_pton(AF_INET, ip.c_str(), &address) == 1);
}

}  // namespace vantage
