#include "schema/messages/transport.h"

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <lcm/lcm-cpp.hpp>
#include <utility>

#include "schema/base/error.h"
#include "schema/messages/network_checks.h"
#include "schema/messages/quiet_stderr.h"

namespace vantage {
namespace {

using namespace std::chrono_literals;

constexpr int kConnectTimeoutMs = 2000;
constexpr auto kRetryEvery = 250ms;
/// Sending is paced on multicast: unpaced bursts lose most of their datagrams in the receivers' socket buffers, up to
/// 20,000 a second none were lost (300 bytes, 4 MiB buffers).
constexpr int kUdpBurst = 32;
constexpr auto kUdpPause = 2ms;
constexpr std::size_t kMaxOutgoing = 20'000;

std::string with_default_option(std::string options, const std::string& name, const std::string& value) {
  if (options.find(name) != std::string::npos) return options;
  return options + (options.empty() ? "" : "&") + name + "=" + value;
}

/// liblcm sends a message in five pieces; with Nagle's algorithm each would wait for an acknowledgement.
void send_at_once(int fd) {
  const int on = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

void handle_datagram(const lcm::ReceiveBuffer* buffer, const std::string&,
                     const LcmTransport::OnDatagram* on_datagram) {
  (*on_datagram)({static_cast<const char*>(buffer->data), buffer->data_size});
}

}  // namespace

LcmTransport::LcmTransport(LcmUrl url, std::vector<std::string> channels, OnDatagram on_datagram)
    : url_(std::move(url)), channels_(std::move(channels)), on_datagram_(std::move(on_datagram)) {
  if (url_.scheme == "udpm") {
    // The default 212,992 bytes lose 98 % of large bursts.
    url_.options = with_default_option(url_.options, "recv_buf_size", "4194304");
    if (const std::string why = why_no_multicast(url_); !why.empty())
      throw Error(ErrorKind::BadInput, fmt::format("bus {}: {}", url_.text(), why));
  }
  wake_fd_ = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  check(wake_fd_ >= 0, "the process has file descriptors left");
  try {
    if (url_.scheme != "tcpq") {
      connect();
      connected_ = true;
    }
  } catch (...) {
    close(wake_fd_);
    throw;
  }
  thread_ = std::thread([this] { run(); });
}

LcmTransport::~LcmTransport() {
  stop_ = true;
  eventfd_write(wake_fd_, 1);
  thread_.join();
  close(wake_fd_);
}

void LcmTransport::send(const std::string& channel, std::string datagram) {
  {
    const std::lock_guard lock(mutex_);
    if (outgoing_.size() >= kMaxOutgoing) outgoing_.pop_front();
    outgoing_.push_back({channel, std::move(datagram)});
  }
  eventfd_write(wake_fd_, 1);
}

void LcmTransport::run() {
  auto next_try = std::chrono::steady_clock::now();
  while (!stop_) {
    if (!connected_ && std::chrono::steady_clock::now() >= next_try) {
      connect_if_broker_answers();
      next_try = std::chrono::steady_clock::now() + kRetryEvery;
    }
    wait();
    send_waiting();
    receive_waiting();
  }
  send_waiting();  // what was said last before the end, such as a worker's farewell
  abandon();
}

void LcmTransport::connect() {
  std::unique_ptr<lcm::LCM> fresh;
  {
    const QuietStderr quiet;
    fresh = std::make_unique<lcm::LCM>(url_.text());
  }
  const int fd = fresh->good() ? fresh->getFileno() : -1;
  if (fd < 0) throw Error(ErrorKind::BadInput, fmt::format("bus {}: LCM cannot be set up", url_.text()));
  check(fd < FD_SETSIZE, "LCM's select() needs a low descriptor: make the bus before opening many files");
  for (const std::string& channel : channels_) {
    lcm::Subscription* subscription =
        fresh->subscribeFunction(channel, handle_datagram, static_cast<const OnDatagram*>(&on_datagram_));
    if (subscription == nullptr)
      throw Error(ErrorKind::BadInput,
                  fmt::format("bus {}: cannot subscribe to {}: does multicast loop back?", url_.text(), channel));
    subscription->setQueueCapacity(0);  // liblcm would drop all but 30; ours is the bounded one
  }
  lcm_ = std::move(fresh);
}

bool LcmTransport::reconnect() {
  if (!lcm_) {
    connect();
    return true;
  }
  // liblcm connects and subscribes again when it publishes; handle() would do so, too, but then wait for a message.
  const QuietStderr quiet;
  return lcm_->publish("VANTAGE_NOBODY", "", 0) == 0;
}

void LcmTransport::connect_if_broker_answers() {
  try {
    if (const std::string why = why_no_tcp_connection(url_, kConnectTimeoutMs); !why.empty())
      throw Error(ErrorKind::Transient, why);
    if (!reconnect()) throw Error(ErrorKind::Transient, "the broker hung up");
    send_at_once(lcm_->getFileno());
    connected_ = true;
    if (std::exchange(said_lost_, false)) spdlog::info("bus {}: connected", url_.text());
  } catch (const Error& e) {
    if (!std::exchange(said_lost_, true))
      spdlog::warn("bus {}: {}; trying again until it answers", url_.text(), e.what());
  }
}

void LcmTransport::note_result(int result) {
  // On multicast a lost route heals by itself; on TCP liblcm has closed the socket.
  if (result == 0 || url_.scheme != "tcpq") return;
  connected_ = false;
  if (!std::exchange(said_lost_, true)) spdlog::warn("bus {}: the broker has gone; connecting again", url_.text());
}

void LcmTransport::abandon() {
  if (connected_ || !lcm_) return;
  // Destroying an LCM object that has lost its broker connects once more for every subscription, which may take minutes
  // when the host is down. So it stays until the process ends.
  static std::mutex mutex;
  static auto* abandoned = new std::vector<std::unique_ptr<lcm::LCM>>;
  const std::lock_guard lock(mutex);
  abandoned->push_back(std::move(lcm_));
}

void LcmTransport::wait() {
  pollfd fds[2] = {{.fd = wake_fd_, .events = POLLIN, .revents = 0},
                   {.fd = connected_ ? lcm_->getFileno() : -1, .events = POLLIN, .revents = 0}};
  poll(fds, 2, static_cast<int>(kRetryEvery.count()));
  eventfd_t ignored = 0;
  eventfd_read(wake_fd_, &ignored);
}

void LcmTransport::send_waiting() {
  std::deque<Outgoing> batch;
  {
    const std::lock_guard lock(mutex_);
    batch.swap(outgoing_);
  }
  int num_in_burst = 0;
  for (const Outgoing& o : batch) {
    if (!connected_) return;
    if (url_.scheme == "udpm" && ++num_in_burst % kUdpBurst == 0) std::this_thread::sleep_for(kUdpPause);
    note_result(lcm_->publish(o.channel, o.datagram.data(), static_cast<unsigned>(o.datagram.size())));
  }
}

void LcmTransport::receive_waiting() {
  constexpr int kMaxInARow = 256;  // then let what waits be sent
  for (int i = 0; i < kMaxInARow && connected_; ++i) {
    pollfd p{.fd = lcm_->getFileno(), .events = POLLIN, .revents = 0};
    if (poll(&p, 1, 0) <= 0) return;
    note_result(lcm_->handle());
  }
}

}  // namespace vantage
