#include "worker/worker_loop.h"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <limits>

#include "schema/base/clock.h"
#include "schema/base/error.h"
#include "schema/base/log_file.h"
#include "schema/formats/job_file.h"
#include "schema/messages/endpoint.h"
#include "worker/agent.h"
#include "worker/children.h"
#include "worker/commit.h"
#include "worker/exec_command.h"
#include "worker/log_limit.h"
#include "worker/machine.h"
#include "worker/signals.h"
#include "worker/store_watch.h"
#include "worker/worker_state.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// STATE/worker.log and its predecessors.
constexpr int kLogMb = 20, kNumLogs = 5;
constexpr std::int64_t kMinReportPauseMs = 5;
constexpr std::int64_t kReportEveryMs = 1000;
constexpr std::int64_t kReportUntilHeardMs = 200;  ///< before the first orders: the scheduler may have just come up
constexpr std::int64_t kTickEveryMs = 250;
constexpr std::int64_t kLookAtStoresEveryMs = 1000;
constexpr std::int64_t kOutboxEveryMs = 200;  ///< most results are acknowledged before they need to be kept
constexpr std::int64_t kFarewellMs = 2000;    ///< wait for acknowledgements before a drained worker ends
constexpr std::int64_t kTellDropsEveryMs = 60'000;
constexpr int kExitReplaced = 2;

/// What the worker knows of a running attempt beside the agent.
struct Attempt {
  std::string spec_path;
  LogLimit log;
};

/// Joins the pure agent to processes, messages, files and signals. One thread.
class Worker {
 public:
  Worker(const WorkerOptions& options, const WorkerProgram& program)
      : children_(fork_servers(program)),
        program_(program),
        state_(options.state_dir),
        agent_(config_of(options, program, state_), state_.read_outbox()),
        parent_(options.parent_pid),
        endpoint_({.url = options.bus_url,
                   .farm = read_farm_key(options.farm_key_file),
                   .role = LcmEndpoint::Role::Worker,
                   .sender = state_.worker_id(),
                   .incarnation = state_.incarnation()}) {
    stores_.learn(state_.folder());
    // A parent that dies without a word is noticed at once; SIGHUP also says that the terminal has gone.
    if (options.parent_pid != 0) prctl(PR_SET_PDEATHSIG, SIGHUP);
  }

  int run() {
    also_log_to(state_.folder() / "worker.log", kLogMb, kNumLogs);
    spdlog::info("worker {} on {}: {}", state_.worker_id(), host_name(), state_.folder().string());
    while (!is_finished()) {
      wait();
      take_signals();
      take_messages();
      for (Children& children : children_) take_news(children.take());
      if (now_ms() >= next_tick_ms_) tick();
      send_report_when_due();
      save_outbox();
    }
    return exit_status_;
  }

 private:
  /// Of this program, then of the light one when there is one.
  static std::deque<Children> fork_servers(const WorkerProgram& program) {
    const fs::path self = fs::read_symlink("/proc/self/exe");
    std::deque<Children> servers;
    servers.emplace_back(exec_fork_server(self.string()));
    const fs::path light = self.parent_path() / program.light_program;
    if (!program.light_program.empty() && access(light.c_str(), X_OK) == 0)
      servers.emplace_back(exec_fork_server(light.string()));
    return servers;
  }

  Children& children_for(const Assignment& a) {
    const auto& light = program_.light_kinds;
    const bool is_light = std::find(light.begin(), light.end(), a.kind) != light.end();
    return is_light ? children_.back() : children_.front();
  }

  static AgentConfig config_of(const WorkerOptions& options, const WorkerProgram& program, const WorkerState& state) {
    AgentConfig config;
    config.worker_id = state.worker_id();
    config.incarnation = state.incarnation();
    config.host = host_name();
    config.pool = options.pool;
    config.slots = options.slots;
    config.cores = options.cores > 0 ? options.cores : num_usable_cores();
    config.ram_mb = options.ram_mb > 0 ? options.ram_mb : total_ram_mb() / 10 * 9;
    config.stuck_after_ms = std::int64_t{options.stuck_after_s} * 1000;
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
    std::vector<pollfd> fds{{.fd = signals_.fd(), .events = POLLIN, .revents = 0},
                            {.fd = endpoint_.wake_fd(), .events = POLLIN, .revents = 0}};
    for (const Children& children : children_) fds.push_back({.fd = children.fd(), .events = POLLIN, .revents = 0});
    const std::int64_t until_ms = std::min(next_tick_ms_, next_report_ms_);
    poll(fds.data(), fds.size(), static_cast<int>(std::clamp<std::int64_t>(until_ms - now_ms(), 0, kTickEveryMs)));
  }

  void take_signals() {
    for (int s = 0; (s = signals_.take()) != 0;) {
      if (s == SIGHUP && parent_ != 0 && getppid() == parent_) continue;
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
      if (const auto* orders = std::get_if<WorkerOrders>(&message)) apply(agent_.on_orders(*orders, now_ms()));
  }

  void take_news(const Children::News& news) {
    if (news.lost.empty() && news.ended.empty()) return;
    if (!news.lost.empty()) {
      spdlog::warn("the fork server died, and {} jobs with it: they will be given out again", news.lost.size());
      apply(agent_.on_lost(news.lost, now_ms()));
    }
    for (const Children::Ended& ended : news.ended) {
      apply(agent_.on_child_exit({.ref = ended.ref,
                                  .exit_code = ended.exit_code,
                                  .signal = ended.signal,
                                  .wall_ms = ended.wall_ms,
                                  .peak_rss_mb = ended.peak_rss_mb,
                                  .out_of_memory = ended.out_of_memory,
                                  .has_outcome = ended.has_outcome,
                                  .outcome = ended.outcome},
                                 now_ms()));
    }
    send_report_when_due();
    for (const Children::Ended& ended : news.ended) clean_up(ended);
    for (const AttemptRef& ref : news.lost) clean_up({.ref = ref, .signal = SIGKILL, .outcome = {}});
  }

  /// After the report: deleting a large scratch folder takes its time.
  void clean_up(const Children::Ended& ended) {
    std::error_code ignored;  // the folder is cleared again at the next start
    fs::remove_all(state_.scratch_of(ended.ref), ignored);
    const auto found = attempts_.find(ended.ref);
    if (found == attempts_.end()) return;
    found->second.log.enforce();
    if (ended.signal != 0) remove_what_it_left(found->second.spec_path, ended.pid);
    attempts_.erase(found);
  }

  /// The half-made artifact of a killed child. A spec that cannot be read was the child's to complain about.
  static void remove_what_it_left(const std::string& spec_path, pid_t pid) {
    if (spec_path.empty()) return;
    try {
      const JobFile job = read_job_file(spec_path);
      remove_private_folders_of(job.store, job.key, pid);
    } catch (const Error& e) {
      spdlog::debug("{}", e.what());
    }
  }

  void tick() {
    next_tick_ms_ = now_ms() + kTickEveryMs;
    if (parent_ != 0 && getppid() != parent_) quit();
    for (Children& children : children_) {
      for (const AttemptRef& ref : children.running()) {
        const Children::Progress progress = children.progress(ref);
        const TreeUsage usage = children.usage(ref);
        apply(agent_.on_progress({ref, progress.phase, progress.fraction, usage.rss_mb}, usage.cpu_ticks, now_ms()));
      }
    }
    for (auto& [ref, attempt] : attempts_) attempt.log.enforce();
    apply(agent_.on_tick(now_ms(), available_ram_mb()));
    look_at_stores();
    tell_dropped();
    if (const bool connected = endpoint_.connected(); connected != was_connected_) {
      was_connected_ = connected;
      if (connected) changed_ = true;
    }
  }

  /// Messages that were not believed, by reason; once a minute while there are new ones. Older ones are the rule.
  void tell_dropped() {
    const DropCounts drops = endpoint_.drops();
    const std::int64_t num_strange = drops.total() - drops.older;
    if (num_strange == num_drops_told_ || now_ms() < next_drops_ms_) return;
    next_drops_ms_ = now_ms() + kTellDropsEveryMs;
    num_drops_told_ = num_strange;
    spdlog::warn(
        "messages dropped so far: {} of other farms, {} badly signed, {} of another version, {} malformed, {} too many",
        drops.foreign, drops.bad_mac, drops.version, drops.malformed, drops.queue_full);
    if (const auto other = endpoint_.other_version())
      spdlog::warn("'{}' speaks version {} of the farm's protocol, this program version {}: bring both to one version",
                   other->sender, other->version, kProtocolVersion);
  }

  void look_at_stores() {
    if (now_ms() < next_look_ms_) return;
    next_look_ms_ = now_ms() + kLookAtStoresEveryMs;
    std::string trouble = stores_.trouble();
    if (trouble == trouble_) return;
    trouble_ = std::move(trouble);
    spdlog::warn("{}", trouble_.empty() ? "there is room again: taking work" : trouble_ + ": taking no work");
    apply(agent_.on_trouble(trouble_, now_ms()));
  }

  /// A job inside the worker ends at once and may make room for the next: a queue, since there may be hundreds.
  void apply(Actions actions) {
    std::deque<Assignment> to_start;
    for (;;) {
      changed_ |= actions.state_changed;
      outbox_grew_ |= actions.outbox_grew;
      for (const SignalChild& s : actions.signals)
        for (Children& children : children_) children.signal_group(s.ref, s.signal);
      if (!actions.replaced_by.empty()) stop_as_replaced(actions.replaced_by);
      to_start.insert(to_start.end(), actions.start.begin(), actions.start.end());
      if (to_start.empty()) return;
      const Assignment next = std::move(to_start.front());
      to_start.pop_front();
      actions = start(next);
    }
  }

  void stop_as_replaced(const std::string& host) {
    if (quit_) return;
    spdlog::error(
        "{}: another worker with this identity has started on {}, from a copy of this folder; stopping. Remove "
        "worker.json from one of the two and start that one again",
        state_.folder().string(), host);
    exit_status_ = kExitReplaced;
    quit_ = true;
    apply(agent_.on_quit_request(now_ms()));
  }

  Actions start(const Assignment& a) {
    try {
      if (const RunEntry* run = in_worker_run(a)) return run_here(a, *run);
      children_for(a).start({.ref = a.ref,
                             .spec_path = a.spec_path,
                             .spec_hash = a.spec_hash,
                             .kind = a.kind,
                             .spec = a.spec,
                             .log_path = a.log_path,
                             .scratch_dir = state_.scratch_of(a.ref).string(),
                             .cores = a.cores});
      attempts_.emplace(a.ref, Attempt{a.spec_path, LogLimit(a.log_path)});
      if (!a.spec_path.empty()) stores_.learn(fs::path(a.spec_path).parent_path());
      return {};
    } catch (const std::exception& e) {
      return failed(a, error_of(e, state_.folder()));
    }
  }

  const RunEntry* in_worker_run(const Assignment& a) const {
    for (const RunEntry& entry : program_.runs)
      if (entry.spec.in_worker && a.kind == kind_and_version(entry.spec)) return &entry;
    return nullptr;
  }

  Actions run_here(const Assignment& a, const RunEntry& entry) {
    const std::int64_t start_ms = now_ms();
    const JobFile job = a.spec_path.empty() ? inline_job(a.kind, a.spec) : read_job_file(a.spec_path);
    run_without_artifact(job, entry.run, {.scratch_dir = state_.scratch_of(a.ref), .on_progress = {}});
    ChildExit exit;
    exit.ref = a.ref;
    exit.has_outcome = true;
    exit.outcome.content = kNothingPublished;
    exit.wall_ms = now_ms() - start_ms;
    return agent_.on_child_exit(exit, now_ms());
  }

  Actions failed(const Assignment& a, const Error& error) {
    ChildExit exit;
    exit.ref = a.ref;
    exit.has_outcome = true;
    exit.outcome.outcome = Outcome::Failed;
    exit.outcome.error_kind = to_string(error.kind());
    exit.outcome.message = one_line(error.what());
    return agent_.on_child_exit(exit, now_ms());
  }

  void send_report_when_due() {
    const std::int64_t now = now_ms();
    const std::int64_t every = agent_.has_seen_orders() ? kReportEveryMs : kReportUntilHeardMs;
    const std::int64_t due = last_report_ms_ + (changed_ ? kMinReportPauseMs : every);
    if (now >= due) {
      endpoint_.publish(agent_.report({.now_ms = now,
                                       .free_disk_mb = free_disk(),
                                       .wall_ms = system_clock().wall_ms(),
                                       .num_dropped = endpoint_.drops().total()}));
      last_report_ms_ = now;
      changed_ = false;
      next_report_ms_ = now + every;
    } else {
      next_report_ms_ = due;
    }
  }

  std::int32_t free_disk() const {
    std::error_code error;
    const auto space = fs::space(state_.folder(), error);
    return error ? 0
                 : static_cast<std::int32_t>(
                       std::min<std::uintmax_t>(space.available >> 20U, std::numeric_limits<std::int32_t>::max()));
  }

  void save_outbox() {
    const bool shrank = agent_.done_unacked().size() < num_saved_;
    if (!outbox_grew_ && !shrank) return;
    if (now_ms() < next_outbox_ms_ && !agent_.is_drained()) return;
    next_outbox_ms_ = now_ms() + kOutboxEveryMs;
    try {
      state_.write_outbox(agent_.done_unacked());
      num_saved_ = agent_.done_unacked().size();
    } catch (const std::exception& e) {
      spdlog::warn("results are reported but cannot be kept over a restart: {}", e.what());
    }
    outbox_grew_ = false;
  }

  Signals signals_;                // first: threads made later inherit the blocked signals
  std::deque<Children> children_;  // before threads are made
  const WorkerProgram& program_;
  WorkerState state_;
  Agent agent_;
  pid_t parent_;
  LcmEndpoint endpoint_;
  std::map<AttemptRef, Attempt> attempts_;  ///< that have a child
  StoreWatch stores_;
  std::string trouble_;
  bool asked_to_stop_ = false, quit_ = false;
  int exit_status_ = 0;
  bool changed_ = true, outbox_grew_ = false, was_connected_ = false;
  std::int64_t last_report_ms_ = 0, next_report_ms_ = 0, next_tick_ms_ = 0, next_outbox_ms_ = 0, next_look_ms_ = 0,
               drained_at_ms_ = -1;
  std::size_t num_saved_ = 0;
  std::int64_t num_drops_told_ = 0, next_drops_ms_ = 0;
};

}  // namespace

int run_worker(const WorkerOptions& options, const WorkerProgram& program) {
  if (options.bus_url.empty() || options.farm_key_file.empty() || options.state_dir.empty())
    throw Error(ErrorKind::BadInput,
                "a worker needs --bus URL, --farm-key FILE and --state DIR (see vantage-worker --help)");
  return Worker(options, program).run();
}

}  // namespace vantage
