#include "tests/support/raw_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>

#include "schema/base/error.h"

namespace vantage {

RawClient::RawClient(const std::string& url) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const auto host_at = url.find("//") + 2, colon = url.rfind(':');
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(url.substr(colon + 1))));
  inet_pton(AF_INET, url.substr(host_at, colon - host_at).c_str(), &address.sin_addr);
  check(connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0, "the server listens");
}

RawClient::~RawClient() { close(socket_); }

bool RawClient::send(const std::string& bytes) {
  return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
}

std::string RawClient::receive_until(const std::string& part, int timeout_ms) {
  std::string text;
  char buffer[4096];
  pollfd fd{socket_, POLLIN, 0};
  while (poll(&fd, 1, timeout_ms) > 0) {
    const ssize_t n = recv(socket_, buffer, sizeof buffer, 0);
    if (n <= 0) break;
    text.append(buffer, static_cast<std::size_t>(n));
    if (!part.empty() && text.find(part) != std::string::npos) break;
  }
  return text;
}

std::string RawClient::receive_all(int timeout_ms) { return receive_until("", timeout_ms); }

bool RawClient::is_closed_within(int timeout_ms) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(timeout_ms);
  char buffer[4096];
  pollfd fd{socket_, POLLIN, 0};
  while (std::chrono::steady_clock::now() < until)
    if (poll(&fd, 1, 20) > 0 && recv(socket_, buffer, sizeof buffer, 0) <= 0) return true;
  return false;
}

int status_of(const std::string& answer) {
  return answer.starts_with("HTTP/1.1 ") ? std::stoi(answer.substr(9, 3)) : 0;
}

}  // namespace vantage
