#pragma once
#include <optional>
#include <string>

namespace vantage {

/// status 0: no answer, and `error` says why.
struct WebAnswer {
  int status = 0;
  std::string body, date, error;
  bool ok() const { return status >= 200 && status < 300; }
};

/// url: "http://host:port/path" or https. timeout_ms holds for connecting and for each wait. token: bearer, may be
/// empty.
WebAnswer web_get(const std::string& url, const std::string& token, int timeout_ms);
WebAnswer web_post_json(const std::string& url, const std::string& body, int timeout_ms);

}  // namespace vantage
