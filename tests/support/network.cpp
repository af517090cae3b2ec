#include "tests/support/network.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <signal.h>
#include <unistd.h>

#include <charconv>
#include <filesystem>
#include <thread>

#include "schema/base/error.h"
#include "tests/support/processes.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr const char* kPrefix = "vantage-test-";

/// A command line without quotes.
void must(const std::string& command) {
  const Ended ended = run({"sh", "-c", command});
  if (ended.exit_code != 0) throw Error(ErrorKind::Resource, fmt::format("{}: {}", command, ended.output));
}

/// Namespaces of tests that died before they could clean up: the name tells whose.
void remove_left_overs() {
  std::error_code none;
  for (const auto& entry : fs::directory_iterator("/run/netns", none)) {
    const std::string name = entry.path().filename();
    if (!name.starts_with(kPrefix)) continue;
    int pid = 0;
    std::from_chars(name.data() + std::string(kPrefix).size(), name.data() + name.size(), pid);
    if (pid > 0 && kill(pid, 0) != 0) run({"ip", "netns", "del", name});
  }
}

}  // namespace

void in_netns(const std::string& name, const std::function<void()>& fn) {
  if (name.empty()) return fn();
  std::exception_ptr failure;
  std::thread([&] {
    try {
      const int fd = open(("/run/netns/" + name).c_str(), O_RDONLY | O_CLOEXEC);
      check(fd >= 0 && setns(fd, CLONE_NEWNET) == 0, "the namespace is there: " + name);
      close(fd);
      fn();
    } catch (...) {
      failure = std::current_exception();
    }
  }).join();
  if (failure) std::rethrow_exception(failure);
}

std::string Network::why_not() {
  if (geteuid() != 0) return "network namespaces need root";
  for (const char* program : {"ip", "nft"})
    if (run({"sh", "-c", std::string("command -v ") + program}).exit_code != 0)
      return fmt::format("the program '{}' is not installed (packages iproute2, nftables)", program);
  try {
    Network(1, Middle::Bridge).set_loss(0, 50);
    return "";
  } catch (const Error& e) {
    return e.what();
  }
}

Network::Network(int num_hosts, Middle middle)
    : prefix_(fmt::format("{}{}-{:x}-", kPrefix, getpid(), reinterpret_cast<std::uintptr_t>(this) & 0xFFFFFU)),
      num_hosts_(num_hosts),
      kind_(middle) {
  remove_left_overs();
  must("ip netns add " + this->middle());
  if (kind_ == Middle::Bridge)
    must(fmt::format("ip -n {0} link add br0 type bridge && ip -n {0} link set br0 up", this->middle()));
  for (int i = 0; i < num_hosts; ++i) lay_cable(i);
}

Network::~Network() {
  for (int i = 0; i < num_hosts_; ++i) run({"ip", "netns", "del", host(i)});
  run({"ip", "netns", "del", middle()});
}

std::string Network::host(int index) const { return fmt::format("{}{}", prefix_, index); }

std::string Network::address(int index) const {
  return kind_ == Middle::Bridge ? fmt::format("10.77.0.{}", index + 1) : fmt::format("10.77.{}.2", index + 1);
}

void Network::lay_cable(int index) {
  const std::string ns = host(index), port = fmt::format("port{}", index);
  must(
      fmt::format("ip netns add {0} && ip -n {0} link set lo up && ip -n {1} link add {2} type veth peer name eth0 "
                  "netns {0} && ip -n {1} link set {2} up",
                  ns, middle(), port));
  must(
      fmt::format("ip -n {0} addr add {1}/24 dev eth0 && ip -n {0} link set eth0 up && ip -n {0} route add "
                  "239.0.0.0/8 dev eth0",
                  ns, address(index)));
  if (kind_ == Middle::Bridge)
    must(fmt::format("ip -n {} link set {} master br0", middle(), port));
  else
    must(fmt::format("ip -n {} addr add 10.77.{}.1/24 dev {}", middle(), index + 1, port));
}

void Network::set_loss(int index, int percent) {
  const std::string rule = percent >= 100 ? "drop" : fmt::format("numgen random mod 100 < {} drop", percent);
  std::string script = "add table inet loss; delete table inet loss; table inet loss { ";
  script += fmt::format("chain in {{ type filter hook input priority 0; iifname eth0 {} ; }} ; ", rule);
  if (percent >= 100) script += "chain out { type filter hook output priority 0; oifname eth0 drop ; } ; ";
  must(fmt::format("ip netns exec {} nft '{}}}'", host(index), script));
}

}  // namespace vantage
