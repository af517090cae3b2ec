#pragma once
#include <atomic>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace lcm {
class LCM;
}

namespace vantage {

/// An LCM URL, taken apart.
struct LcmUrl {
  std::string scheme;  ///< udpm, tcpq or memq
  std::string host;
  int port = 0;
  std::string options;  ///< after '?', may be empty
  std::string text() const;
};
/// Throws Error(BadInput) saying what is wrong and what is expected.
LcmUrl parse_lcm_url(const std::string& url);

/// One LCM object and the one thread that uses it: liblcm is not safe for several threads on tcpq, its reconnecting
/// prints a line per try, and waiting on its closed descriptor aborts the process. So nobody else touches it, a broker
/// is knocked at before liblcm may connect, and a lost connection means a new LCM object.
class LcmTransport {
 public:
  using OnDatagram = std::function<void(std::string_view)>;  ///< runs in the transport's thread; must not throw

  /// channels: the ones to hear, by their exact names.
  /// Throws Error(BadInput) when multicast is not set up.
  LcmTransport(LcmUrl url, std::vector<std::string> channels, OnDatagram on_datagram);
  ~LcmTransport();
  LcmTransport(const LcmTransport&) = delete;
  LcmTransport& operator=(const LcmTransport&) = delete;

  /// Any thread; never blocks. While there is no connection datagrams are dropped: they are states and will be
  /// repeated.
  void send(const std::string& channel, std::string datagram);
  bool connected() const { return connected_; }

 private:
  struct Outgoing {
    std::string channel, datagram;
  };
  void run();
  void connect();
  void connect_if_broker_answers();
  bool reconnect();
  void note_result(int result);
  void abandon();
  void wait();
  void send_waiting();
  void receive_waiting();

  LcmUrl url_;
  std::vector<std::string> channels_;
  OnDatagram on_datagram_;
  std::unique_ptr<lcm::LCM> lcm_;
  int wake_fd_ = -1;
  std::mutex mutex_;
  std::deque<Outgoing> outgoing_;  ///< guarded by mutex_
  std::atomic<bool> stop_ = false;
  std::atomic<bool> connected_ = false;
  bool said_lost_ = false;  ///< one line per outage, not per try
  std::thread thread_;
};

}  // namespace vantage
