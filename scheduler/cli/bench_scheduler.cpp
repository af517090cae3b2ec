#include "scheduler/cli/bench_scheduler.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "jobs/probe/probe_kinds.h"
#include "scheduler/farm/farm.h"
#include "schema/base/error.h"
#include "schema/messages/transport.h"

namespace vantage {
namespace {

/// Up to the line's end; empty when the other side has gone.
std::string read_line(int fd) {
  std::string line;
  for (char c = 0; read(fd, &c, 1) == 1;) {
    if (c == '\n') return line;
    line += c;
  }
  return "";
}

void write_line(int fd, std::string line) {
  line += '\n';
  if (send(fd, line.data(), line.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(line.size()))
    throw Error(ErrorKind::Resource, "the scheduler that is measured has ended");
}

}  // namespace

BenchScheduler::BenchScheduler(std::filesystem::path state_dir, int lease_ms)
    : state_dir_(std::move(state_dir)), lease_ms_(lease_ms) {}

void BenchScheduler::start() {
  int ends[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    throw Error(ErrorKind::Resource, "no file descriptor is left for a scheduler");
  pid_ = fork();
  if (pid_ < 0) throw Error(ErrorKind::Resource, "no process is left for a scheduler");
  if (pid_ == 0) {
    close(ends[0]);
    serve(ends[1]);
  }
  close(ends[1]);
  fd_ = ends[0];
  bus_url_ = ask("");
  broker_port_ = parse_lcm_url(bus_url_).port;
}

void BenchScheduler::kill() {
  if (pid_ < 0) return;
  ::kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  close(fd_);
  pid_ = fd_ = -1;
}

void BenchScheduler::submit(const std::filesystem::path& shot) { ask(shot.string()); }

/// The answer is one line: "ok …" or "error …".
std::string BenchScheduler::ask(const std::string& line) {
  write_line(fd_, line);
  const std::string answer = read_line(fd_);
  if (answer.starts_with("ok ")) return answer.substr(3);
  throw Error(ErrorKind::Resource, answer.empty() ? "the scheduler that is measured has ended" : answer);
}

/// An empty line asks where the bus is, any other is the folder of a shot to submit.
void BenchScheduler::serve(int fd) const {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  try {
    FarmScheduler farm({.state_dir = state_dir_,
                        .bus_url = "",
                        .listen = "127.0.0.1",
                        .broker_port = broker_port_,
                        .http_address = "",
                        .lease_ms = lease_ms_,
                        .kinds = &probe_kinds()});
    write_line(fd, (read_line(fd), "ok " + farm.bus_url()));
    for (std::string shot; !(shot = read_line(fd)).empty();) {
      farm.submit({.folder = shot, .until_kind = "", .priority = 0}).get();
      write_line(fd, "ok submitted");
    }
  } catch (const std::exception& e) {  // the process' boundary: who asked says it
    const std::string line = fmt::format("error: {}\n", e.what());
    if (write(fd, line.data(), line.size()) < 0) _exit(2);
    _exit(1);
  }
  _exit(0);
}

std::int64_t BenchScheduler::cpu_ms() const {
  std::ifstream file(fmt::format("/proc/{}/stat", pid_));
  std::string text;
  std::getline(file, text);
  std::istringstream fields(text.substr(text.rfind(')') + 1));  // state is the first field after the name
  std::string skipped;
  for (int field = 3; field <= 13; ++field) fields >> skipped;
  std::int64_t user = 0, system = 0;
  fields >> user >> system;
  return (user + system) * 1000 / sysconf(_SC_CLK_TCK);
}

std::int64_t BenchScheduler::peak_rss_mb() const {
  std::ifstream file(fmt::format("/proc/{}/status", pid_));
  for (std::string word; file >> word;)
    if (word == "VmHWM:") {
      std::int64_t kb = 0;
      file >> kb;
      return kb / 1024;
    }
  return 0;
}

}  // namespace vantage
