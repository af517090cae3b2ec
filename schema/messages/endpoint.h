#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "schema/messages/codec.h"

namespace vantage {

class LcmTransport;

/// One end of the farm's bus: the scheduler's, or a worker's. Messages are whole states and may be lost; publish again
/// until the other side has converged.
///
/// URLs: `tcpq://host:port` through the broker (broker.h); connects, and connects again, by itself.
///       `udpm://239.255.76.67:7667?ttl=1` multicast; orders and hellos on that port, reports on the next one.
///       `memq://` within one endpoint object, for tests: it hears itself.
/// All LCM work is done by one thread of the endpoint; every member function may be called from any thread and none
/// blocks on the network.
class LcmEndpoint {
 public:
  enum class Role { Scheduler, Worker };
  struct Config {
    std::string url;
    Farm farm;
    Role role = Role::Worker;
    std::string sender;                ///< the worker's id, or kSchedulerSender
    std::int64_t incarnation = 0;      ///< the worker's, or the scheduler's epoch
    std::size_t max_waiting = 20'000;  ///< received messages that nobody took; the oldest go first
  };
  /// Throws Error(BadInput) for a bad URL, and when multicast is not set up (with the commands that mend it).
  /// A tcpq broker that is not there yet is no error.
  explicit LcmEndpoint(Config config);
  ~LcmEndpoint();
  LcmEndpoint(const LcmEndpoint&) = delete;
  LcmEndpoint& operator=(const LcmEndpoint&) = delete;

  void publish(const SchedulerHello& hello);  ///< scheduler → all
  void publish(const WorkerOrders& orders);   ///< scheduler → orders.worker_id
  void publish(const WorkerReport& report);   ///< worker → scheduler

  /// All messages that came since the last call, in order; at once. A scheduler gets reports; a worker gets hellos and
  /// its own orders.
  std::vector<Message> take();
  /// take(), after waiting for at least one message or the time-out.
  std::vector<Message> wait(std::chrono::milliseconds timeout);
  /// Readable while messages wait: for poll() and epoll.
  int wake_fd() const;

  bool connected() const;
  DropCounts drops() const;
  std::optional<OtherVersion> other_version() const;

 private:
  struct Inbox;
  void send(LcmTransport& transport, const std::string& channel, const Message& message);

  Config config_;
  std::unique_ptr<Inbox> inbox_;
  std::unique_ptr<LcmTransport> down_;  ///< orders and hellos
  std::unique_ptr<LcmTransport> up_;    ///< reports; null when one transport carries both
  std::mutex send_mutex_;
  std::int64_t last_seq_ = 0;  ///< guarded by send_mutex_
};

}  // namespace vantage
