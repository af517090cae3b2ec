#include "schema/messages/endpoint.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <deque>
#include <mutex>

#include "schema/base/error.h"
#include "schema/base/hash.h"
#include "schema/messages/transport.h"

namespace vantage {
namespace {

constexpr const char* kReportsChannel = "VANTAGE_REPORTS";
constexpr const char* kHelloChannel = "VANTAGE_HELLO";

/// One channel per worker, so that a broker sends orders to the one they are for. Of fixed length and without
/// characters that mean something in a pattern, since LCM's subscriptions are regular expressions of at most 63
/// characters.
std::string orders_channel(const std::string& worker_id) { return "VANTAGE_ORDERS_" + sha256_key(worker_id); }

}  // namespace

struct LcmEndpoint::Inbox {
  Inbox(const Farm& farm, std::size_t max)
      : decoder(farm), max_waiting(max), wake_fd(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    check(wake_fd >= 0, "the process has file descriptors left");
  }
  ~Inbox() { close(wake_fd); }
  Inbox(const Inbox&) = delete;
  Inbox& operator=(const Inbox&) = delete;

  void on_datagram(std::string_view datagram) {
    const std::lock_guard lock(mutex);
    auto message = decoder.take(datagram);
    if (!message) return;
    if (waiting.size() >= max_waiting) {
      waiting.pop_front();
      ++num_queue_full;
    }
    waiting.push_back(std::move(*message));
    eventfd_write(wake_fd, 1);
  }

  std::mutex mutex;  ///< guards everything below
  Decoder decoder;
  std::deque<Message> waiting;
  std::int64_t num_queue_full = 0;
  std::size_t max_waiting;
  int wake_fd;
};

LcmEndpoint::LcmEndpoint(Config config)
    : config_(std::move(config)), inbox_(std::make_unique<Inbox>(config_.farm, config_.max_waiting)) {
  const LcmUrl url = parse_lcm_url(config_.url);
  std::vector<std::string> from_below{kReportsChannel};
  std::vector<std::string> from_above{kHelloChannel, orders_channel(config_.sender)};
  const bool is_scheduler = config_.role == Role::Scheduler;
  const auto on_datagram = [inbox = inbox_.get()](std::string_view datagram) { inbox->on_datagram(datagram); };
  if (url.scheme == "udpm") {
    // liblcm binds to any address, so only ports keep the two streams apart: workers need not read each other's
    // reports.
    LcmUrl reports_url = url;
    ++reports_url.port;
    down_ = std::make_unique<LcmTransport>(url, is_scheduler ? std::vector<std::string>{} : from_above, on_datagram);
    up_ = std::make_unique<LcmTransport>(reports_url, is_scheduler ? from_below : std::vector<std::string>{},
                                         on_datagram);
  } else if (url.scheme == "memq") {
    from_below.insert(from_below.end(), from_above.begin(), from_above.end());
    down_ = std::make_unique<LcmTransport>(url, from_below, on_datagram);
  } else {
    down_ = std::make_unique<LcmTransport>(url, is_scheduler ? from_below : from_above, on_datagram);
  }
}

LcmEndpoint::~LcmEndpoint() {
  down_.reset();  // their threads use the inbox
  up_.reset();
}

void LcmEndpoint::send(LcmTransport& transport, const std::string& channel, const Message& message) {
  const std::lock_guard lock(
      send_mutex_);  // or two threads' messages could overtake each other and be dropped as older
  const Origin origin{.sender = config_.sender, .incarnation = config_.incarnation, .seq = ++last_seq_};
  for (std::string& datagram : encode(message, origin, config_.farm)) transport.send(channel, std::move(datagram));
}

void LcmEndpoint::publish(const SchedulerHello& hello) { send(*down_, kHelloChannel, hello); }
void LcmEndpoint::publish(const WorkerOrders& orders) { send(*down_, orders_channel(orders.worker_id), orders); }
void LcmEndpoint::publish(const WorkerReport& report) { send(up_ ? *up_ : *down_, kReportsChannel, report); }

std::vector<Message> LcmEndpoint::take() {
  const std::lock_guard lock(inbox_->mutex);
  eventfd_t ignored = 0;
  eventfd_read(inbox_->wake_fd, &ignored);
  std::vector<Message> out(std::make_move_iterator(inbox_->waiting.begin()),
                           std::make_move_iterator(inbox_->waiting.end()));
  inbox_->waiting.clear();
  return out;
}

std::vector<Message> LcmEndpoint::wait(std::chrono::milliseconds timeout) {
  pollfd p{.fd = inbox_->wake_fd, .events = POLLIN, .revents = 0};
  poll(&p, 1, static_cast<int>(timeout.count()));
  return take();
}

int LcmEndpoint::wake_fd() const { return inbox_->wake_fd; }

bool LcmEndpoint::connected() const { return down_->connected() && (!up_ || up_->connected()); }

std::optional<OtherVersion> LcmEndpoint::other_version() const {
  const std::lock_guard lock(inbox_->mutex);
  return inbox_->decoder.other_version();
}

DropCounts LcmEndpoint::drops() const {
  const std::lock_guard lock(inbox_->mutex);
  DropCounts counts = inbox_->decoder.drops();
  counts.queue_full = inbox_->num_queue_full;
  return counts;
}

}  // namespace vantage
