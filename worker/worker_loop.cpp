#include "worker/worker_loop.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <limits>

#include "schema/base/clock.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/formats/job_file.h"
#include "schema/messages/endpoint.h"
#include "worker/agent.h"
#include "worker/children.h"
#include "worker/commit.h"
#include "worker/execute_job.h"
#include "worker/machine.h"
#include "worker/worker_state.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kMinReportPauseMs = 5;
constexpr std::int64_t kReportEveryMs = 1000;
constexpr std::int64_t kReportUntilHeardMs = 200;  ///< before the first orders: the scheduler may have just come up
constexpr std::int64_t kTickEveryMs = 250;
constexpr std::int64_t kFarewellMs = 2000;  ///< wait for acknowledgements before a drained worker ends

/// Signals as something to poll; blocked from here on in every thread made later.
class Signals {
 public:
  Signals() {
    sigset_t set;
    sigemptyset(&set);
    for (const int s : {SIGTERM, SIGINT, SIGHUP, SIGCHLD}) sigaddset(&set, s);
    sigprocmask(SIG_BLOCK, &set, nullptr);
    fd_ = signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
    check(fd_ >= 0, "the process has file descriptors left");
  }
  ~Signals() { close(fd_); }
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;
  int fd() const { return fd_; }
  /// The next one; 0 when there is none.
  int take() {
    signalfd_siginfo info{};
    return read(fd_, &info, sizeof info) == sizeof info ? static_cast<int>(info.ssi_signo) : 0;
  }

 private:
  int fd_;
};

/// Joins the pure agent to processes, messages, files and signals. One thread.
class Worker {
 public:
  Worker(const WorkerOptions& options, const WorkerProgram& program)
      : state_(options.state_dir),
        agent_(config_of(options, program, state_), state_.read_outbox()),
        parent_(options.die_with_parent ? getppid() : 0),
        endpoint_({.url = options.bus_url,
                   .farm = read_farm_key(options.farm_key_file),
                   .role = LcmEndpoint::Role::Worker,
                   .sender = state_.worker_id(),
                   .incarnation = state_.incarnation()}) {
    // A parent that dies without a word is noticed at once; SIGHUP also says that the terminal has gone.
    if (options.die_with_parent) prctl(PR_SET_PDEATHSIG, SIGHUP);
  }

  int run() {
    spdlog::info("worker {} on {}: {}", state_.worker_id(), host_name(), state_.folder().string());
    while (!is_finished()) {
      wait();
      take_signals();
      take_messages();
      take_exits();
      if (now_ms() >= next_tick_ms_) tick();
      send_report_when_due();
      save_outbox();
    }
    return exit_code_;
  }

 private:
  static AgentConfig config_of(const WorkerOptions& options, const WorkerProgram& program, const WorkerState& state) {
    AgentConfig config;
    config.worker_id = state.worker_id();
    config.incarnation = state.incarnation();
    config.host = host_name();
    config.pool = options.pool;
    config.slots = options.slots;
    config.cores = options.cores > 0 ? options.cores : num_usable_cores();
    config.ram_mb = options.ram_mb > 0 ? options.ram_mb : total_ram_mb() / 10 * 9;
    config.tags = options.tags;
    config.build = VANTAGE_VERSION;
    Capabilities capabilities = capabilities_of(program.runs);
    for (const std::string& sentence : capabilities.missing) spdlog::warn("{}: such jobs go elsewhere", sentence);
    config.kinds = std::move(capabilities.kinds);
    return config;
  }

  static std::int64_t now_ms() { return system_clock().monotonic_ms(); }

  bool is_finished() {
    if (!agent_.is_drained()) return false;
    if (drained_at_ms_ < 0) drained_at_ms_ = now_ms();
    return quit_ || agent_.done_unacked().empty() || now_ms() - drained_at_ms_ > kFarewellMs;
  }

  void wait() {
    std::vector<pollfd> fds;
    for (const int fd : children_.exit_fds()) fds.push_back({.fd = fd, .events = POLLIN, .revents = 0});
    for (const int fd : {signals_.fd(), endpoint_.wake_fd()}) fds.push_back({.fd = fd, .events = POLLIN, .revents = 0});
    const std::int64_t until_ms = std::min(next_tick_ms_, next_report_ms_);
    poll(fds.data(), fds.size(), static_cast<int>(std::clamp<std::int64_t>(until_ms - now_ms(), 0, kTickEveryMs)));
  }

  void take_signals() {
    for (int s = 0; (s = signals_.take()) != 0;) {
      if (s == SIGCHLD || (s == SIGHUP && parent_ != 0 && getppid() == parent_)) continue;
      const bool again = std::exchange(asked_to_stop_, true);
      if (s == SIGTERM && !again) {
        spdlog::info("draining: finishing what runs");
        apply(agent_.on_drain_request());
      } else {
        quit();
      }
    }
  }

  void quit() {
    if (std::exchange(quit_, true)) return;
    spdlog::info("stopping");
    apply(agent_.on_quit_request(now_ms()));
  }

  void take_messages() {
    for (const Message& message : endpoint_.take())
      if (const auto* orders = std::get_if<WorkerOrders>(&message)) {
        apply(agent_.on_orders(*orders, now_ms()));
        if (orders->incarnation > state_.incarnation()) give_way();
      }
  }

  /// The farm talks to a later start with our id, and our lock says that it is not in our folder.
  void give_way() {
    if (std::exchange(exit_code_, 1) == 1) return;
    spdlog::error(
        "{}: another worker with this identity has started, from a copy of this folder: remove worker.json from one "
        "of the two and start that one again",
        state_.folder().string());
    quit();
  }

  void take_exits() {
    for (const Children::Ended& ended : children_.reap()) {
      const AttemptFiles files = state_.files_of(ended.ref);
      ChildExit exit{.ref = ended.ref,
                     .exit_code = ended.exit_code,
                     .signal = ended.signal,
                     .wall_ms = ended.wall_ms,
                     .peak_rss_mb = ended.peak_rss_mb,
                     .out_of_memory = ended.out_of_memory,
                     .has_outcome = false,
                     .outcome = {}};
      if (const auto outcome = read_outcome(files.outcome())) {
        exit.has_outcome = true;
        exit.outcome = *outcome;
      }
      const Actions actions = agent_.on_child_exit(exit, now_ms());
      apply(actions);
      send_report_when_due();
      clean_up(ended);
    }
  }

  /// After the report: deleting a large scratch folder takes its time.
  void clean_up(const Children::Ended& ended) {
    std::error_code ignored;  // the folder is cleared again at the next start
    fs::remove_all(state_.files_of(ended.ref).folder, ignored);
    const auto store = stores_.find(ended.ref);
    if (store == stores_.end()) return;
    if (ended.signal != 0) remove_private_folders_of(store->second.first, store->second.second, ended.pid);
    stores_.erase(store);
  }

  void tick() {
    next_tick_ms_ = now_ms() + kTickEveryMs;
    if (parent_ != 0 && getppid() != parent_) quit();
    for (const AttemptRef& ref : children_.running()) {
      const Progress progress = read_progress(state_.files_of(ref).progress()).value_or(Progress{0, "running"});
      apply(agent_.on_progress({ref, progress.phase, progress.fraction, children_.rss_mb(ref)}));
    }
    apply(agent_.on_tick(now_ms()));
    if (const bool connected = endpoint_.connected(); connected != was_connected_) {
      was_connected_ = connected;
      if (connected) changed_ = true;
    }
  }

  void apply(const Actions& actions) {
    changed_ |= actions.state_changed;
    outbox_grew_ |= actions.outbox_grew;
    for (const SignalChild& s : actions.signals) children_.signal_group(s.ref, s.signal);
    for (const Assignment& a : actions.start) start(a);
  }

  void start(const Assignment& a) {
    try {
      const AttemptFiles files = state_.files_of(a.ref);
      fs::create_directories(files.scratch());
      children_.start({.ref = a.ref, .argv = command_of(a, files), .log_path = a.log_path});
      remember_store(a);
    } catch (const std::exception& e) {
      ChildExit exit;
      exit.ref = a.ref;
      exit.has_outcome = true;
      const Error error = error_of(e, state_.folder());
      exit.outcome.outcome = Outcome::Failed;
      exit.outcome.error_kind = to_string(error.kind());
      exit.outcome.message = one_line(error.what());
      apply(agent_.on_child_exit(exit, now_ms()));
    }
  }

  std::vector<std::string> command_of(const Assignment& a, const AttemptFiles& files) const {
    return {program_.string(),
            "exec",
            a.spec_path,
            "--spec-hash",
            a.spec_hash,
            "--cores",
            std::to_string(a.cores),
            "--outcome",
            files.outcome().string(),
            "--progress",
            files.progress().string(),
            "--scratch",
            files.scratch().string()};
  }

  /// Where a killed child may leave a half-made artifact. A spec that cannot be read is the child's to complain about.
  void remember_store(const Assignment& a) {
    try {
      const JobFile job = read_job_file(a.spec_path);
      stores_[a.ref] = {job.store, job.key};
    } catch (const Error& e) {
      spdlog::debug("{}", e.what());
    }
  }

  void send_report_when_due() {
    const std::int64_t now = now_ms();
    const std::int64_t every = agent_.has_seen_orders() ? kReportEveryMs : kReportUntilHeardMs;
    const std::int64_t due = last_report_ms_ + (changed_ ? kMinReportPauseMs : every);
    if (now >= due) {
      endpoint_.publish(agent_.report(machine_state()));
      last_report_ms_ = now;
      changed_ = false;
      next_report_ms_ = now + every;
    } else {
      next_report_ms_ = due;
    }
  }

  MachineState machine_state() const {
    return {.free_disk_mb = free_disk(),
            .wall_ms = system_clock().wall_ms(),
            .num_dropped = endpoint_.drops().total(),
            .trouble = {}};
  }

  std::int32_t free_disk() const {
    std::error_code error;
    const auto space = fs::space(state_.folder(), error);
    return error ? 0
                 : static_cast<std::int32_t>(
                       std::min<std::uintmax_t>(space.available >> 20U, std::numeric_limits<std::int32_t>::max()));
  }

  /// After the report has gone: being durable takes milliseconds, and the report is what the farm waits for.
  void save_outbox() {
    const bool shrank = agent_.done_unacked().size() < num_saved_;
    if (!outbox_grew_ && !(shrank && now_ms() >= next_outbox_ms_)) return;
    try {
      state_.write_outbox(agent_.done_unacked());
      num_saved_ = agent_.done_unacked().size();
      outbox_grew_ = false;
    } catch (const Error& e) {
      spdlog::warn("results are reported but cannot be kept over a restart: {}", e.what());
      outbox_grew_ = false;
    }
    next_outbox_ms_ = now_ms() + kReportEveryMs;
  }

  Signals signals_;  // first: threads made later inherit the blocked signals
  WorkerState state_;
  Agent agent_;
  pid_t parent_;
  LcmEndpoint endpoint_;
  Children children_;
  fs::path program_ = fs::read_symlink("/proc/self/exe");
  std::map<AttemptRef, std::pair<fs::path, std::string>> stores_;  ///< store and key of running attempts
  bool asked_to_stop_ = false, quit_ = false;
  int exit_code_ = 0;
  bool changed_ = true, outbox_grew_ = false, was_connected_ = false;
  std::int64_t last_report_ms_ = 0, next_report_ms_ = 0, next_tick_ms_ = 0, next_outbox_ms_ = 0, drained_at_ms_ = -1;
  std::size_t num_saved_ = 0;
};

}  // namespace

int run_worker(const WorkerOptions& options, const WorkerProgram& program) {
  if (options.bus_url.empty() || options.farm_key_file.empty() || options.state_dir.empty())
    throw Error(ErrorKind::BadInput,
                "a worker needs --bus URL, --farm-key FILE and --state DIR (see vantage-worker --help)");
  return Worker(options, program).run();
}

}  // namespace vantage
