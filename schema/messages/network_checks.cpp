#include "schema/messages/network_checks.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>

namespace vantage {
namespace {

/// IPv4 only, like liblcm.
std::optional<sockaddr_in> resolve(const LcmUrl& url) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(url.host.c_str(), nullptr, &hints, &found) != 0) return std::nullopt;
  sockaddr_in address{};
  std::memcpy(&address, found->ai_addr, sizeof address);
  freeaddrinfo(found);
  address.sin_port = htons(static_cast<std::uint16_t>(url.port));
  return address;
}

/// 0, or the errno of the attempt.
int try_connect(int fd, const sockaddr_in& address, int timeout_ms) {
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  pollfd p{.fd = fd, .events = POLLOUT, .revents = 0};
  if (poll(&p, 1, timeout_ms) <= 0) return ETIMEDOUT;
  int error = 0;
  socklen_t size = sizeof error;
  getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
  return error;
}

std::string why_no_connection(const LcmUrl& url, int socket_type, int timeout_ms) {
  const auto address = resolve(url);
  if (!address) return fmt::format("no such host '{}'", url.host);
  const int fd = socket(AF_INET, socket_type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return std::strerror(errno);
  const int error = try_connect(fd, *address, timeout_ms);
  close(fd);
  return error == 0 ? "" : std::strerror(error);
}

}  // namespace

std::string why_no_tcp_connection(const LcmUrl& url, int timeout_ms) {
  return why_no_connection(url, SOCK_STREAM, timeout_ms);
}

std::string why_no_multicast(const LcmUrl& url) {
  in_addr address{};
  if (inet_aton(url.host.c_str(), &address) == 0 || !IN_MULTICAST(ntohl(address.s_addr)))
    return fmt::format("{} is not a multicast address (expected 224.0.0.0 to 239.255.255.255)", url.host);
  const std::string why = why_no_connection(url, SOCK_DGRAM, 0);
  if (why.empty()) return "";
  return fmt::format(
      "{}: this machine has no route for multicast. As root, for one machine: 'ip link set lo multicast on; ip route "
      "add 224.0.0.0/4 dev "
      "lo'; for a LAN: 'ip route add 224.0.0.0/4 dev INTERFACE' and ?ttl=1 in the URL. Or use the broker: "
      "tcpq://host:port",
      why);
}

}  // namespace vantage
