#pragma once
#include <array>
#include <atomic>
#include <map>
#include <mutex>
#include <string>

#include "scheduler/api/connection.h"
#include "scheduler/api/http_library.h"

namespace vantage {

/// Why a connection was turned away before its request was looked at.
enum class Refusal { TooManyConnections, TooManyOfAddress, BadHead };
inline constexpr std::array<const char*, 3> kRefusalNames{"too_many_connections", "too_many_of_address", "bad_head"};

/// httplib's server behind our own limits (see limits.h): its own ones leave a client that drips bytes, or never says
/// how much it will send, in possession of a thread.
class LimitedServer final : public httplib::Server {
 public:
  explicit LimitedServer(const HttpLimits& limits);
  /// Ends all waiting: call before stop().
  void stop_waiting() { stopping_ = true; }
  bool stopping() const { return stopping_; }
  int num_connections() const { return num_connections_; }
  std::int64_t num_refused(Refusal why) const { return num_refused_.at(static_cast<std::size_t>(why)); }

 private:
  bool process_and_close_socket(socket_t socket) override;
  void serve(Connection& connection);
  /// Empty when there is room for one more.
  std::optional<EarlyAnswer> admit(const std::string& address);
  void leave(const std::string& address);
  void count(Refusal why) { ++num_refused_.at(static_cast<std::size_t>(why)); }

  HttpLimits limits_;
  std::atomic<bool> stopping_{false};
  std::atomic<int> num_connections_{0};
  std::array<std::atomic<std::int64_t>, kRefusalNames.size()> num_refused_{};
  std::mutex mutex_;
  std::map<std::string, int> num_by_address_;
};

}  // namespace vantage
