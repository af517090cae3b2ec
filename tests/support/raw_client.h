#pragma once
#include <string>

namespace vantage {

/// A TCP client that says exactly what a test wants, and as slowly: for servers that must not be impressed.
class RawClient {
 public:
  /// url: "http://127.0.0.1:8080"
  explicit RawClient(const std::string& url);
  ~RawClient();
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;

  /// False when the other end has closed.
  bool send(const std::string& bytes);
  /// What comes until the other end closes, or nothing comes for so long.
  std::string receive_all(int timeout_ms = 5000);
  /// What comes until it contains a text, or as above.
  std::string receive_until(const std::string& part, int timeout_ms = 5000);
  /// The other end closes within the time, whatever it sends before.
  bool is_closed_within(int timeout_ms);

 private:
  int socket_;
};

/// Status of the first answer in a text; 0 when there is none.
int status_of(const std::string& answer);

}  // namespace vantage
