/// Cost of a child process per job: requests to a worker's fork server, two at a time, for jobs that do nothing.
///
///   children_bench WORKER_PROGRAM [JOBS]     prints one JSON line; beside it, `xargs -P2 /bin/true` on the same
///   machine
#include <fmt/format.h>
#include <poll.h>

#include <chrono>
#include <cstdlib>

#include "schema/base/json.h"
#include "worker/children.h"

namespace vantage {
namespace {

double now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Milliseconds per job.
double with_fork_server(const std::string& program, int num_jobs) {
  constexpr int kSlots = 2;
  Children children(exec_fork_server(program));
  int num_started = 0, num_ended = 0;
  const auto start_one = [&] {
    children.start({.ref = {++num_started, 1, 1}, .kind = "process/1", .log_path = "/dev/null"});
  };
  start_one();
  double start_s = 0;  // the first child waits for the libraries of the server
  while (num_ended < num_jobs) {
    pollfd p{.fd = children.fd(), .events = POLLIN, .revents = 0};
    poll(&p, 1, -1);
    num_ended += static_cast<int>(children.take().ended.size());
    if (start_s == 0 && num_ended == 1) start_s = now_s();
    while (start_s > 0 && num_started < num_jobs && num_started < num_ended + kSlots) start_one();
  }
  return 1e3 * (now_s() - start_s) / (num_jobs - 1);
}

double with_xargs(int num_jobs) {
  const double start_s = now_s();
  const int status = std::system(fmt::format("seq {} | xargs -P2 -n1 /bin/true", num_jobs).c_str());
  return status == 0 ? 1e3 * (now_s() - start_s) / num_jobs : 0;
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: children_bench WORKER_PROGRAM [JOBS]\n");
    return 2;
  }
  const int num_jobs = argc > 2 ? std::atoi(argv[2]) : 2000;
  const double ours_ms = vantage::with_fork_server(argv[1], num_jobs), xargs_ms = vantage::with_xargs(num_jobs);
  fmt::print("{}\n", vantage::Json({{"bench", "children"},
                                    {"num_jobs", num_jobs},
                                    {"fork_server_ms_per_job", ours_ms},
                                    {"xargs_ms_per_job", xargs_ms},
                                    {"ratio", ours_ms / xargs_ms}})
                         .dump());
}
