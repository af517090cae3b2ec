#include "tests/support/udp_relay.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>

#include "schema/base/clock.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr const char* kGroup = "239.255.76.67";
constexpr int kBufferBytes = 8 << 20;

template <class T>
void set(int fd, int level, int option, const T& value) {
  check(setsockopt(fd, level, option, &value, sizeof value) == 0, fmt::format("socket option {} can be set", option));
}

/// Hears and speaks to the group on one cable only.
int group_socket(const std::string& interface, std::uint16_t port) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  check(fd >= 0, "a socket can be made");
  set(fd, SOL_SOCKET, SO_REUSEADDR, 1);
  set(fd, SOL_SOCKET, SO_RCVBUFFORCE, kBufferBytes);
  set(fd, SOL_SOCKET, SO_SNDBUFFORCE, kBufferBytes);
  check(setsockopt(fd, SOL_SOCKET, SO_BINDTODEVICE, interface.c_str(), static_cast<socklen_t>(interface.size())) == 0,
        "the cable is there: " + interface);
  ip_mreqn membership{};
  inet_pton(AF_INET, kGroup, &membership.imr_multiaddr);
  membership.imr_ifindex = static_cast<int>(if_nametoindex(interface.c_str()));
  set(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, membership);
  set(fd, IPPROTO_IP, IP_MULTICAST_IF, membership);
  set(fd, IPPROTO_IP, IP_MULTICAST_LOOP, 0);
  set(fd, IPPROTO_IP, IP_MULTICAST_TTL, 1);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  check(bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0, "the port is free");
  return fd;
}

std::int64_t now_ms() { return system_clock().monotonic_ms(); }

}  // namespace

UdpRelay::UdpRelay(const Network& network, int num_hosts, std::vector<std::uint16_t> ports, unsigned seed)
    : random_(seed) {
  in_netns(network.middle(), [&] { open_sockets(num_hosts, ports); });
  thread_ = std::thread([this] { run(); });
}

UdpRelay::~UdpRelay() {
  stop_ = true;
  thread_.join();
  for (const Socket& socket : sockets_) close(socket.fd);
}

void UdpRelay::open_sockets(int num_hosts, const std::vector<std::uint16_t>& ports) {
  for (int host = 0; host < num_hosts; ++host)
    for (const std::uint16_t port : ports)
      sockets_.push_back({group_socket(fmt::format("port{}", host), port), host, port});
}

void UdpRelay::set_weather(const Weather& weather) {
  const std::lock_guard lock(mutex_);
  weather_ = weather;
}

void UdpRelay::record() {
  const std::lock_guard lock(mutex_);
  recording_ = true;
}

std::size_t UdpRelay::replay() {
  const std::lock_guard lock(mutex_);
  recording_ = false;
  for (const Datagram& datagram : recorded_) {
    send(datagram);
    usleep(100);  // a burst would be lost in the receivers' buffers
  }
  return recorded_.size();
}

UdpRelay::Counts UdpRelay::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

bool UdpRelay::chance(int percent) { return static_cast<int>(random_() % 100) < percent; }

void UdpRelay::run() {
  std::vector<pollfd> fds;
  for (const Socket& socket : sockets_) fds.push_back({.fd = socket.fd, .events = POLLIN, .revents = 0});
  while (!stop_) {
    poll(fds.data(), fds.size(), 1);
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < fds.size(); ++i)
      if ((fds[i].revents & POLLIN) != 0) take(sockets_[i]);
    const std::int64_t now = now_ms();
    for (const Pending& pending : pending_)
      if (pending.due_ms <= now) send(pending.datagram);
    std::erase_if(pending_, [&](const Pending& pending) { return pending.due_ms <= now; });
  }
}

void UdpRelay::take(const Socket& socket) {
  std::string bytes(65536, '\0');
  for (ssize_t n = 0; (n = recv(socket.fd, bytes.data(), bytes.size(), 0)) > 0;)
    carry({bytes.substr(0, static_cast<std::size_t>(n)), socket.host, socket.port});
}

void UdpRelay::carry(Datagram datagram) {
  ++counts_.carried;
  if (recording_) recorded_.push_back(datagram);
  const int num_copies = chance(weather_.duplicate_percent) ? 2 : 1;
  counts_.duplicated += num_copies - 1;
  for (int copy = 0; copy < num_copies; ++copy) {
    Datagram sent = datagram;
    if (chance(weather_.corrupt_percent)) {
      sent.bytes[random_() % sent.bytes.size()] ^= static_cast<char>(1 + random_() % 255);
      ++counts_.corrupted;
    }
    const std::int64_t delay_ms = weather_.max_delay_ms > 0 ? random_() % (weather_.max_delay_ms + 1U) : 0;
    counts_.delayed += delay_ms > 0 ? 1 : 0;
    if (delay_ms == 0)
      send(sent);
    else
      pending_.push_back({now_ms() + delay_ms, std::move(sent)});
  }
}

void UdpRelay::send(const Datagram& datagram) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(datagram.port);
  inet_pton(AF_INET, kGroup, &to.sin_addr);
  for (const Socket& socket : sockets_)
    if (socket.port == datagram.port && socket.host != datagram.from_host)
      sendto(socket.fd, datagram.bytes.data(), datagram.bytes.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
}

}  // namespace vantage
