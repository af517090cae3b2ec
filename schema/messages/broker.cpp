#include "schema/messages/broker.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <map>
#include <set>
#include <thread>
#include <utility>

#include "schema/base/clock.h"
#include "schema/base/error.h"
#include "schema/messages/broker_client.h"

namespace vantage {
namespace {

constexpr int kLookEveryMs = 200;

int listen_at(const Broker::Config& config) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(config.port);
  if (inet_aton(config.host.c_str(), &address.sin_addr) == 0)
    throw Error(ErrorKind::BadInput, fmt::format("broker: '{}' is not an IPv4 address such as 127.0.0.1", config.host));
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (fd < 0 || bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 || listen(fd, 1024) != 0) {
    const int saved = errno;
    if (fd >= 0) close(fd);
    throw Error(ErrorKind::BadInput,
                fmt::format("broker: cannot listen at {}:{}: {}", config.host, config.port, std::strerror(saved)));
  }
  return fd;
}

std::uint16_t port_of(int fd) {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

}  // namespace

/// Everything but counts and stop_ belongs to the thread.
class Broker::Hub {
 public:
  explicit Hub(const Config& config) : config_(config), listen_fd_(listen_at(config)), port_(port_of(listen_fd_)) {
    epoll_fd_ = epoll_create1(EPOLL_CLOEXEC);
    stop_fd_ = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    spare_fd_ = open("/dev/null", O_RDONLY | O_CLOEXEC);
    check(epoll_fd_ >= 0 && stop_fd_ >= 0 && spare_fd_ >= 0, "the process has file descriptors left");
    watch(EPOLL_CTL_ADD, listen_fd_, EPOLLIN);
    watch(EPOLL_CTL_ADD, stop_fd_, EPOLLIN);
    thread_ = std::thread([this] { run(); });
  }
  ~Hub() {
    stop_ = true;
    eventfd_write(stop_fd_, 1);
    thread_.join();
    for (const auto& [fd, client] : clients_) close(fd);
    for (const int fd : {epoll_fd_, stop_fd_, listen_fd_, spare_fd_})
      if (fd >= 0) close(fd);
  }
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  const Config& config() const { return config_; }
  std::uint16_t port() const { return port_; }
  Counts counts() const {
    return {num_clients_, num_relayed_, num_dropped_, num_refused_, num_silent_, num_nonsense_, num_too_fast_};
  }

 private:
  struct Client {
    TcpqParser parser;
    FrameQueue queue;
    std::int64_t since_ms = 0;
    bool waits_for_room = false;  ///< epoll tells when the socket can be written
    std::int64_t second = 0;      ///< in which num_bytes came
    std::size_t num_bytes = 0;
  };

  void watch(int operation, int fd, std::uint32_t events) {
    epoll_event event{};
    event.events = events;
    event.data.fd = fd;
    check(epoll_ctl(epoll_fd_, operation, fd, &event) == 0, "epoll takes our own descriptors");
  }

  void run() {
    std::array<epoll_event, 64> events{};
    while (!stop_) {
      const int n = epoll_wait(epoll_fd_, events.data(), static_cast<int>(events.size()), kLookEveryMs);
      for (int i = 0; i < n; ++i) {
        const auto& event = events[static_cast<std::size_t>(i)];
        if (event.data.fd == listen_fd_)
          accept_all();
        else if (event.data.fd != stop_fd_)
          serve(event.data.fd, event.events);
      }
      remove_silent();
      remove_broken();
    }
  }

  void accept_all() {
    for (;;) {
      const int fd = accept4(listen_fd_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
      if (fd < 0 && (errno == EMFILE || errno == ENFILE)) {
        refuse_one();
        return;
      }
      if (fd < 0) return;
      if (clients_.size() >= config_.max_clients) {
        ++num_refused_;
        close(fd);
        continue;
      }
      const int on = 1;
      setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);  // a machine that lost power is noticed in the end
      TcpqParser::Events on_message{.on_hello = [this, fd] { enqueue(fd, server_hello()); },
                                    .on_publish = [this](const TcpqParser::Publish& p) { relay(p); }};
      clients_.emplace(fd, Client{.parser = TcpqParser(std::move(on_message)),
                                  .queue = FrameQueue(config_.max_queue_bytes_per_client),
                                  .since_ms = now_ms()});
      watch(EPOLL_CTL_ADD, fd, EPOLLIN);
      num_clients_ = static_cast<std::int64_t>(clients_.size());
    }
  }

  /// Without a descriptor to spare a connection can be neither taken nor refused, and epoll would tell of it for ever.
  void refuse_one() {
    close(spare_fd_);
    if (const int fd = accept4(listen_fd_, nullptr, nullptr, SOCK_CLOEXEC); fd >= 0) {
      ++num_refused_;
      close(fd);
    }
    spare_fd_ = open("/dev/null", O_RDONLY | O_CLOEXEC);
  }

  static std::int64_t now_ms() { return system_clock().monotonic_ms(); }

  void serve(int fd, std::uint32_t events) {
    if (broken_.contains(fd)) return;
    if ((events & EPOLLOUT) != 0) flush(fd);
    if ((events & ~static_cast<std::uint32_t>(EPOLLOUT)) != 0) read_from(fd);
  }

  void read_from(int fd) {
    const ssize_t n = recv(fd, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) return;
    // liblcm sends five small pieces; unless each is acknowledged at once, the next waits for up to 40 ms.
    const int on = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_QUICKACK, &on, sizeof on);
    if (n <= 0) {
      broken_.insert(fd);
    } else if (is_too_fast(clients_.at(fd), static_cast<std::size_t>(n))) {
      ++num_too_fast_;
      broken_.insert(fd);
    } else if (!clients_.at(fd).parser.feed({buffer_.data(), static_cast<std::size_t>(n)})) {
      ++num_nonsense_;
      broken_.insert(fd);
    }
  }

  bool is_too_fast(Client& client, std::size_t num_bytes) const {
    const std::int64_t second = now_ms() / 1000;
    if (std::exchange(client.second, second) != second) client.num_bytes = 0;
    client.num_bytes += num_bytes;
    return client.num_bytes > config_.max_bytes_per_s_per_client;
  }

  void remove_silent() {
    if (now_ms() < next_look_ms_) return;
    next_look_ms_ = now_ms() + kLookEveryMs;
    for (const auto& [fd, client] : clients_)
      if (!client.parser.said_hello() && now_ms() - client.since_ms > config_.hello_within_ms &&
          broken_.insert(fd).second)
        ++num_silent_;
  }

  void relay(const TcpqParser::Publish& publish) {
    for (const auto& [fd, client] : clients_)
      if (client.parser.wants(publish.channel)) enqueue(fd, publish.frame);
    ++num_relayed_;
  }

  void enqueue(int fd, Frame frame) {
    Client& client = clients_.at(fd);
    num_dropped_ += client.queue.push(std::move(frame));
    if (!client.waits_for_room) flush(fd);
  }

  void flush(int fd) {
    Client& client = clients_.at(fd);
    if (!client.queue.write_to(fd)) broken_.insert(fd);
    if (client.waits_for_room == client.queue.empty()) {
      client.waits_for_room = !client.queue.empty();
      watch(EPOLL_CTL_MOD, fd, client.waits_for_room ? EPOLLIN | EPOLLOUT : EPOLLIN);
    }
  }

  /// After a round of events, never amid one: a closed descriptor's number may be given out again.
  void remove_broken() {
    for (const int fd : broken_) {
      clients_.erase(fd);
      close(fd);
    }
    broken_.clear();
    num_clients_ = static_cast<std::int64_t>(clients_.size());
  }

  Config config_;
  int listen_fd_;
  std::uint16_t port_;
  int epoll_fd_ = -1, stop_fd_ = -1;
  int spare_fd_ = -1;  ///< given up for a moment to refuse a connection when there are no others
  std::int64_t next_look_ms_ = 0;
  std::map<int, Client> clients_;
  std::set<int> broken_;
  std::array<char, 1U << 16U> buffer_{};
  std::atomic<bool> stop_ = false;
  std::atomic<std::int64_t> num_clients_ = 0, num_relayed_ = 0, num_dropped_ = 0;
  std::atomic<std::int64_t> num_refused_ = 0, num_silent_ = 0, num_nonsense_ = 0, num_too_fast_ = 0;
  std::thread thread_;
};

Broker::Broker(const Config& config) : hub_(std::make_unique<Hub>(config)) {}
Broker::~Broker() = default;

std::uint16_t Broker::port() const { return hub_->port(); }
std::string Broker::url() const {
  const std::string& host = hub_->config().host;
  return fmt::format("tcpq://{}:{}", host == "0.0.0.0" ? "127.0.0.1" : host, port());
}
Broker::Counts Broker::counts() const { return hub_->counts(); }

}  // namespace vantage
