#include <fmt/format.h>

#include <charconv>

#include "schema/base/error.h"
#include "schema/messages/transport.h"

namespace vantage {
namespace {
[[noreturn]] void bad_url(const std::string& url) {
  throw Error(ErrorKind::BadInput,
              fmt::format("bus '{}': expected tcpq://host:port, udpm://239.255.76.67:7667?ttl=1 or memq://", url));
}
}  // namespace

std::string LcmUrl::text() const {
  const std::string network = host.empty() ? "" : fmt::format("{}:{}", host, port);
  return fmt::format("{}://{}{}{}", scheme, network, options.empty() ? "" : "?", options);
}

LcmUrl parse_lcm_url(const std::string& url) {
  const auto scheme_end = url.find("://");
  if (scheme_end == std::string::npos) bad_url(url);
  LcmUrl out;
  out.scheme = url.substr(0, scheme_end);
  std::string network = url.substr(scheme_end + 3);
  if (const auto question = network.find('?'); question != std::string::npos) {
    out.options = network.substr(question + 1);
    network.resize(question);
  }
  if (out.scheme == "memq") return out;
  const auto colon = network.rfind(':');
  if ((out.scheme != "tcpq" && out.scheme != "udpm") || colon == std::string::npos || colon == 0) bad_url(url);
  out.host = network.substr(0, colon);
  const char* end = network.data() + network.size();
  const auto [rest, error] = std::from_chars(network.data() + colon + 1, end, out.port);
  if (error != std::errc() || rest != end || out.port < 1 || out.port > 65534) bad_url(url);
  return out;
}

}  // namespace vantage
