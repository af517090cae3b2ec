#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "scheduler/farm/file_system.h"
#include "scheduler/upkeep/doctor.h"
#include "schema/base/clock.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "schema/messages/network_checks.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr int kPatienceMs = 5000;

World::Folder look_at(const fs::path& path) {
  World::Folder seen;
  struct stat info {};
  if (stat(path.c_str(), &info) != 0) {
    seen.error = std::strerror(errno);
    return seen;
  }
  seen.is_there = true;
  seen.mode = info.st_mode & 0777U;
  seen.file_system = file_system_of(path);
  seen.free_mb = free_disk_mb(path);
  if (!S_ISDIR(info.st_mode)) return seen;
  try {  // permissions, quotas, read-only mounts: only writing tells
    const fs::path probe = path / fmt::format(".doctor.{}", to_hex(random_bytes(4)));
    write_file_atomically(probe, "probe\n");
    fs::remove(probe);
    seen.is_writable = true;
  } catch (const Error& e) {
    seen.error = e.what();
  }
  return seen;
}

std::optional<std::string> text_of(const fs::path& path) {
  try {
    return read_file(path);
  } catch (const Error&) {
    return std::nullopt;  // the check says what its absence means
  }
}

std::string why_no_bus(const std::string& url) {
  try {
    const LcmUrl bus = parse_lcm_url(url);
    if (bus.scheme == "udpm") return why_no_multicast(bus);
    return bus.scheme == "tcpq" ? why_no_tcp_connection(bus, kPatienceMs) : "";
  } catch (const Error& e) {
    return e.what();
  }
}

/// Joins the group and sends itself a datagram, on a port of its own so that no farm hears it.
std::string why_no_loopback(const std::string& url) {
  const LcmUrl bus = parse_lcm_url(url);
  ip_mreq group{};
  if (inet_aton(bus.host.c_str(), &group.imr_multiaddr) == 0) return "no multicast address";
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return std::strerror(errno);
  sockaddr_in any{};
  any.sin_family = AF_INET;
  socklen_t size = sizeof any;
  const std::string word = to_hex(random_bytes(8));
  std::string heard(64, '\0');
  pollfd p{.fd = fd, .events = POLLIN, .revents = 0};
  bool good = bind(fd, reinterpret_cast<sockaddr*>(&any), sizeof any) == 0 &&
              getsockname(fd, reinterpret_cast<sockaddr*>(&any), &size) == 0 &&
              setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &group, sizeof group) == 0;
  any.sin_addr = group.imr_multiaddr;
  good = good && sendto(fd, word.data(), word.size(), 0, reinterpret_cast<sockaddr*>(&any), sizeof any) > 0;
  std::string why = good ? "" : std::strerror(errno);
  if (good && poll(&p, 1, 1000) != 1) why = "nothing came in one second";
  if (good && why.empty()) {
    heard.resize(static_cast<std::size_t>(std::max<ssize_t>(recv(fd, heard.data(), heard.size(), 0), 0)));
    if (heard != word) why = "something else came";
  }
  close(fd);
  return why;
}

std::uint64_t limit_of(int resource) {
  rlimit limit{};
  getrlimit(static_cast<__rlimit_resource>(resource), &limit);
  return limit.rlim_cur;
}

}  // namespace

World this_machine() {
  return {.folder = look_at,
          .text = text_of,
          .run = [](const std::vector<std::string>& argv) { return run_bounded(argv, "", kPatienceMs); },
          .get = [](const std::string& url, const std::string& token) { return web_get(url, token, kPatienceMs); },
          .why_no_bus = why_no_bus,
          .why_no_loopback = why_no_loopback,
          .limit = limit_of,
          .wall_ms = [] { return system_clock().wall_ms(); }};
}

}  // namespace vantage
