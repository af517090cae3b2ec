#include "scheduler/upkeep/web_client.h"

#include <httplib.h>

namespace vantage {
namespace {

/// "http://host:port" and the rest, "/" at least.
std::pair<std::string, std::string> split(const std::string& url) {
  const auto slashes = url.find("://");
  const auto path = url.find('/', slashes == std::string::npos ? 0 : slashes + 3);
  return path == std::string::npos ? std::pair(url, std::string("/"))
                                   : std::pair(url.substr(0, path), url.substr(path));
}

WebAnswer answer_of(const httplib::Result& result) {
  if (!result) return {.status = 0, .body = "", .date = "", .error = httplib::to_string(result.error())};
  return {.status = result->status,
          .body = result->body,
          .date = result->get_header_value("Date"),
          .error = result->status < 300 ? "" : "status " + std::to_string(result->status)};
}

template <class Ask>
WebAnswer with_client(const std::string& url, int timeout_ms, const Ask& ask) {
  const auto [server, path] = split(url);
  httplib::Client client(server);
  if (!client.is_valid()) return {.status = 0, .body = "", .date = "", .error = "is no address of a server: " + server};
  client.set_connection_timeout(timeout_ms / 1000, timeout_ms % 1000 * 1000);
  client.set_read_timeout(timeout_ms / 1000, timeout_ms % 1000 * 1000);
  client.set_write_timeout(timeout_ms / 1000, timeout_ms % 1000 * 1000);
  return answer_of(ask(client, path));
}

}  // namespace

WebAnswer web_get(const std::string& url, const std::string& token, int timeout_ms) {
  httplib::Headers headers;
  if (!token.empty()) headers.emplace("Authorization", "Bearer " + token);
  return with_client(url, timeout_ms,
                     [&](httplib::Client& client, const std::string& path) { return client.Get(path, headers); });
}

WebAnswer web_post_json(const std::string& url, const std::string& body, int timeout_ms) {
  return with_client(url, timeout_ms, [&](httplib::Client& client, const std::string& path) {
    return client.Post(path, body, "application/json");
  });
}

}  // namespace vantage
