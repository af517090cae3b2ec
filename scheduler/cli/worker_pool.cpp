#include "scheduler/cli/worker_pool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr std::int64_t kEarlyMs = 3000;  ///< a worker that lives shorter did not get to work
constexpr int kMaxEarlyDeaths = 5;

/// In the child: nothing may allocate between fork and exec.
[[noreturn]] void become(char* const* argv, int log_fd) {
  setpgid(0, 0);
  const int null_fd = open("/dev/null", O_RDONLY);
  dup2(null_fd, STDIN_FILENO);
  dup2(log_fd, STDOUT_FILENO);
  dup2(log_fd, STDERR_FILENO);
  signal(SIGINT, SIG_DFL);
  signal(SIGTERM, SIG_DFL);
  execv(argv[0], argv);
  _exit(127);
}

std::string how_it_ended(int status) {
  if (WIFSIGNALED(status)) return fmt::format("was killed by signal {}", WTERMSIG(status));
  return fmt::format("ended with status {}", WEXITSTATUS(status));
}

}  // namespace

WorkerPool::WorkerPool(Options options, const Clock& clock)
    : options_(std::move(options)), clock_(clock), workers_(static_cast<std::size_t>(options_.num_workers)) {
  for (std::size_t i = 0; i < workers_.size(); ++i) start(i);
}

WorkerPool::~WorkerPool() { stop(0); }

std::filesystem::path WorkerPool::log_file(std::size_t index) const {
  return options_.folder / fmt::format("worker-{}.log", index);
}

void WorkerPool::start(std::size_t index) {
  std::vector<std::string> words{options_.program.string(),
                                 "--bus",
                                 options_.bus_url,
                                 "--farm-key",
                                 options_.key_file.string(),
                                 "--state",
                                 (options_.folder / fmt::format("worker-{}", index)).string(),
                                 "--slots",
                                 "1",
                                 "--ram-mb",
                                 std::to_string(options_.ram_mb),
                                 "--parent",
                                 std::to_string(getpid())};
  std::vector<char*> argv;
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const std::string log = log_file(index).string();
  const int log_fd = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log_fd < 0) throw Error(ErrorKind::Resource, fmt::format("{}: cannot be written: {}", log, std::strerror(errno)));
  const pid_t pid = fork();
  if (pid == 0) become(argv.data(), log_fd);
  close(log_fd);
  if (pid < 0) throw Error(ErrorKind::Resource, fmt::format("cannot start a worker: {}", std::strerror(errno)));
  workers_[index].pid = pid;
  workers_[index].started_ms = clock_.monotonic_ms();
}

std::vector<pid_t> WorkerPool::pids() const {
  std::vector<pid_t> pids;
  for (const Worker& worker : workers_) pids.push_back(worker.pid);
  return pids;
}

std::vector<std::string> WorkerPool::mend() {
  std::vector<std::string> sentences;
  for (std::size_t i = 0; i < workers_.size(); ++i) {
    Worker& worker = workers_[i];
    int status = 0;
    if (waitpid(worker.pid, &status, WNOHANG) != worker.pid) continue;
    const bool early = clock_.monotonic_ms() - worker.started_ms < kEarlyMs;
    worker.num_early_deaths = early ? worker.num_early_deaths + 1 : 0;
    worker.pid = -1;
    if (worker.num_early_deaths >= kMaxEarlyDeaths)
      throw Error(ErrorKind::Resource, fmt::format("worker {} {} {} times in a row; see {}", i, how_it_ended(status),
                                                   kMaxEarlyDeaths, log_file(i).string()));
    sentences.push_back(fmt::format("worker {} {}: started again", i, how_it_ended(status)));
    start(i);
  }
  return sentences;
}

bool WorkerPool::reap(Worker& worker) const {
  if (worker.pid > 0 && waitpid(worker.pid, nullptr, WNOHANG) != 0) worker.pid = -1;
  return worker.pid < 0;
}

void WorkerPool::stop(int patience_ms) {
  for (const Worker& worker : workers_)
    if (worker.pid > 0) kill(worker.pid, SIGTERM);
  const std::int64_t give_up_ms = clock_.monotonic_ms() + patience_ms;
  for (bool all_gone = false; !all_gone && clock_.monotonic_ms() < give_up_ms; usleep(10'000)) {
    all_gone = true;
    for (Worker& worker : workers_) all_gone = reap(worker) && all_gone;
  }
  for (Worker& worker : workers_) {
    if (worker.pid <= 0 || reap(worker)) continue;
    kill(-worker.pid, SIGKILL);
    waitpid(worker.pid, nullptr, 0);
    worker.pid = -1;
  }
}

}  // namespace vantage
