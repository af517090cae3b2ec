#include "scheduler/farm/farm.h"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <ctime>
#include <deque>
#include <mutex>
#include <thread>

#include "scheduler/dispatch/dispatcher.h"
#include "scheduler/farm/damage_check.h"
#include "scheduler/farm/file_system.h"
#include "scheduler/farm/lock_file.h"
#include "scheduler/farm/progress_query.h"
#include "scheduler/farm/store_users.h"
#include "scheduler/farm/turn_lock.h"
#include "scheduler/plan/planner.h"
#include "scheduler/publish/publisher.h"
#include "scheduler/store/store.h"
#include "schema/base/error.h"
#include "schema/base/hash.h"
#include "schema/messages/broker.h"
#include "schema/messages/endpoint.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr int kTickMs = 20;
constexpr std::int64_t kProgressMs = 100;
/// One transaction holds at most this many operations, or this much time: an fsync costs about as much as both.
constexpr int kMaxOperationsPerCommit = 64;
constexpr std::int64_t kMaxCommitMs = 20;
/// Reports of a thousand workers come one by one: a few of them share a turn.
constexpr std::int64_t kMinTurnMs = 2;
/// A pause that leases are given back; shorter than any lease by far.
constexpr std::int64_t kStallMs = 1'000;
/// Between tries of a database that cannot be written.
constexpr std::int64_t kFirstRetryMs = 250, kMaxRetryMs = 5'000;

class LcmBus final : public Bus {
 public:
  explicit LcmBus(LcmEndpoint& endpoint) : endpoint_(endpoint) {}
  void send(const WorkerOrders& orders) override { endpoint_.publish(orders); }
  void send(const SchedulerHello& hello) override { endpoint_.publish(hello); }

 private:
  LcmEndpoint& endpoint_;
};

/// Wakes the scheduler's thread out of poll().
class WakeUp {
 public:
  WakeUp() : fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) { check(fd_ >= 0, "an eventfd can always be made"); }
  ~WakeUp() { close(fd_); }
  WakeUp(const WakeUp&) = delete;
  WakeUp& operator=(const WakeUp&) = delete;
  int fd() const { return fd_; }
  void ring() { eventfd_write(fd_, 1); }
  void clear() {
    eventfd_t count = 0;
    eventfd_read(fd_, &count);
  }

 private:
  int fd_;
};

std::uint64_t random_bits() {
  std::uint64_t bits = 0;
  std::memcpy(&bits, random_bytes(sizeof bits).data(), sizeof bits);
  return bits;
}

fs::path made(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(ErrorKind::BadInput, fmt::format("{}: cannot be made: {}", folder.string(), error.message()));
  refuse_network_database(folder);
  return fs::absolute(folder);
}

}  // namespace

class FarmScheduler::Impl {
 public:
  explicit Impl(Options options)
      : options_(std::move(options)),
        state_dir_(made(options_.state_dir)),
        lock_(state_dir_ / "lock"),
        turn_lock_(state_dir_),
        identity_(read_or_create_farm_key(state_dir_ / "farm.key")),
        clock_(system_clock()),
        store_(state_dir_ / "farm.sqlite", clock_),
        planner_(store_, *options_.kinds),
        dispatcher_(store_, planner_, {.farm_id = identity_.id, .lease_ms = options_.lease_ms, .random = random_bits}) {
    {
      const auto turn = turn_lock_.turn();
        store_.begin();
      dispatcher_.recover(clock_.monotonic_ms());
      store_.commit();
    }
    for (const std::string state : {"running", "paused", "done", "failed"})
      for (const ShotRow& shot : store_.shots_in_state(state)) refresh(shot.id);
    if (options_.bus_url.empty()) {
      broker_.emplace(
          Broker::Config{.host = options_.listen, .port = static_cast<std::uint16_t>(options_.broker_port)});
      options_.bus_url = broker_->url();
    }
    endpoint_.emplace(LcmEndpoint::Config{.url = options_.bus_url,
                                          .farm = identity_,
                                          .role = LcmEndpoint::Role::Scheduler,
                                          .sender = std::string(kSchedulerSender),
                                          .incarnation = dispatcher_.epoch()});
    hasher_.emplace([this] { wake_up_.ring(); });
    planner_.read_footage_with(*hasher_);
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~Impl() {
    thread_.request_stop();
    wake_up_.ring();
  }

  const Options& options() const { return options_; }
  const fs::path& state_dir() const { return state_dir_; }
  const std::string& farm_id() const { return identity_.id; }
  DropCounts dropped_messages() const { return endpoint_->drops(); }
  std::optional<Broker::Counts> broker_counts() const {
    return broker_ ? std::optional(broker_->counts()) : std::nullopt;
  }
  FarmHealth health() const {
    const std::lock_guard lock(mutex_);
    return health_;
  }
  FarmStats stats() const {
    const std::lock_guard lock(mutex_);
    return stats_;
  }
  void set_http_address(const std::string& address) {
    const std::lock_guard lock(mutex_);
    http_address_ = address;
  }

  /// fn runs within a transaction on the scheduler's thread; the future is set after its commit.
  template <class Result>
  std::future<Result> post(std::function<Result()> fn) {
    auto promise = std::make_shared<std::promise<Result>>();
    auto future = promise->get_future();
    auto result = std::make_shared<std::optional<Result>>();
    Order order{.apply = [fn = std::move(fn), result] { *result = fn(); },
                .succeed = [promise, result] { promise->set_value(std::move(**result)); },
                .fail = [promise](const std::exception_ptr& why) { promise->set_exception(why); }};
    const std::lock_guard lock(mutex_);
    if (failure_)
      order.fail(failure_);
    else
      orders_.push_back(std::move(order));
    wake_up_.ring();
    return future;
  }

  SubmitResult submit(const SubmitRequest& request) {
    if (fs::exists(request.folder / "shot.toml")) {
      check_store(request.folder);
      note_store_user(request.folder / ".vantage" / "store", identity_.id, state_dir_);
    }
    const ActingAs acting(store_, request.who);
    const auto done = planner_.submit(request.folder, request.until_kind, request.priority);
    ended_soon_.insert(done.shot.id);
    return {.shot = done.shot.id,
            .generation = done.shot.generation,
            .num_jobs = done.num_jobs,
            .num_up_to_date = done.num_up_to_date};
  }
  CommandResult command(const Command& command) {
    CommandResult result = dispatcher_.on_command(command);
    if (command.shot) ended_soon_.insert(*command.shot);
    return result;
  }

  bool note(const std::string& kind, const std::string& text) {
    store_.add_event(std::nullopt, std::nullopt, "", kind, text);
    return true;
  }

  /// The answer of the first time when the order has been carried out before. Within a transaction, as post() says.
  template <class Result>
  Result once(const OnceKey& key, const std::function<Result()>& carry_out) {
    if (key.key.empty()) return carry_out();
    if (const auto kept = store_.kept_answer(key)) return Json::parse(*kept).get<Result>();
    Result result = carry_out();
    store_.keep_answer(key, Json(result).dump(-1, ' ', false, Json::error_handler_t::replace));
    return result;
  }

  std::optional<ShotProgress> progress(ShotId shot) const {
    const std::lock_guard lock(mutex_);
    const auto found = progress_.find(shot);
    return found == progress_.end() ? std::nullopt : std::optional(found->second);
  }
  std::vector<ShotProgress> all_progress() const {
    const std::lock_guard lock(mutex_);
    std::vector<ShotProgress> all;
    for (const auto& [shot, progress] : progress_) all.push_back(progress);
    return all;
  }
  void on_change(std::function<void(const ShotProgress&)> listener) {
    const std::lock_guard lock(mutex_);
    listeners_.push_back(std::move(listener));
  }
  std::optional<ShotProgress> wait(ShotId shot, int timeout_ms) {
    std::unique_lock lock(mutex_);
    const auto has_ended = [&] {
      const auto found = progress_.find(shot);
      return failure_ || (found != progress_.end() && found->second.finished());
    };
    if (!changed_.wait_for(lock, std::chrono::milliseconds(timeout_ms), has_ended)) return std::nullopt;
    if (failure_) std::rethrow_exception(failure_);
    return progress_.at(shot);
  }

 private:
  struct Order {
    std::function<void()> apply, succeed;
    std::function<void(const std::exception_ptr&)> fail;
  };

  void run(const std::stop_token& stop) {
    try {
      LcmBus bus(*endpoint_);
      damage_check_.emplace(state_dir_);
      for (looked_ms_ = clock_.monotonic_ms(); !stop.stop_requested();) {
        wait_for_work();
        give_back_stall();
        if (retry_ms_ != 0 && !try_database_again()) continue;
        try {
          turn(bus);
        } catch (const DatabaseError& e) {
          give_up_turn(e);
        }
      }
    } catch (const std::exception& e) {  // the thread's boundary: tells everybody who waits for it
      spdlog::error("scheduler: stopped: {}", e.what());
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
      for (const Order& order : std::exchange(orders_, {})) order.fail(failure_);
      for (const Order& order : applied_) order.fail(failure_);
      changed_.notify_all();
    }
  }

  void wait_for_work() {
    if (!reports_.empty()) return;
    pollfd fds[] = {{endpoint_->wake_fd(), POLLIN, 0}, {wake_up_.fd(), POLLIN, 0}};
    poll(fds, 2, kTickMs);
    const std::int64_t early_ms = woken_ms_ + kMinTurnMs - clock_.monotonic_ms();
    if (early_ms > 0) std::this_thread::sleep_for(std::chrono::milliseconds(early_ms));
    woken_ms_ = clock_.monotonic_ms();
    wake_up_.clear();
    for (Message& message : endpoint_->take())
      if (auto* report = std::get_if<WorkerReport>(&message)) reports_.push_back(std::move(*report));
  }

  /// The process was stopped, or a transaction took long: nobody's lease ran meanwhile.
  void give_back_stall() {
    const std::int64_t now_ms = clock_.monotonic_ms(), stall_ms = now_ms - std::exchange(looked_ms_, now_ms);
    if (stall_ms < kStallMs) return;
    dispatcher_.on_stall(stall_ms);
    ++counts_.num_stalls;
  }

  /// Nothing was sent of what could not be written. What the dispatcher and the planner know may be half of it, so they
  /// begin anew, as after a restart, once the database can be written again.
  void give_up_turn(const DatabaseError& e) {
    store_.rollback();
    for (const Order& order : std::exchange(applied_, {})) order.fail(std::make_exception_ptr(e));
    retry_ms_ = clock_.monotonic_ms() + kFirstRetryMs;
    retry_pause_ms_ = kFirstRetryMs;
    spdlog::error("scheduler: the database cannot be written: {}; tried again until it can", e.what());
    set_trouble(
        fmt::format("the database cannot be written: {}. Nothing is lost: the farm goes on by itself", e.what()));
  }

  bool try_database_again() {
    fail_waiting_orders();
    reports_.clear();  // of an epoch that ends: they are sent again
    const std::int64_t now_ms = clock_.monotonic_ms();
    if (now_ms < retry_ms_) return false;
    const auto turn = turn_lock_.turn();
    try {
      store_.begin();
      dispatcher_.recover(now_ms);
      store_.commit();
    } catch (const DatabaseError&) {  // said once, shown while it lasts
      store_.rollback();
      retry_pause_ms_ = std::min(2 * retry_pause_ms_, kMaxRetryMs);
      retry_ms_ = now_ms + retry_pause_ms_;
      return false;
    }
    retry_ms_ = 0;
    spdlog::info("scheduler: the database can be written again");
    set_trouble("");
    return true;
  }

  /// Whoever asks meanwhile is told at once.
  void fail_waiting_orders() {
    std::vector<Order> orders;
    {
      const std::lock_guard lock(mutex_);
      orders = std::exchange(orders_, {});
    }
    for (const Order& order : orders) order.fail(std::make_exception_ptr(Error(ErrorKind::Resource, health().trouble)));
  }

  void set_trouble(const std::string& text) {
    const std::lock_guard lock(mutex_);
    if (health_.trouble == text) return;
    health_ = {.trouble = text, .since_wall_ms = text.empty() ? 0 : clock_.wall_ms()};
  }

  void count_turn() {
    timespec cpu{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &cpu);
    counts_.cpu_ms = std::int64_t{cpu.tv_sec} * 1'000 + cpu.tv_nsec / 1'000'000;
    counts_.epoch = dispatcher_.epoch();
    counts_.num_claimed = dispatcher_.num_claimed();
    counts_.num_ended = store_.num_ended();
    counts_.num_waiting_reports = static_cast<std::int64_t>(reports_.size());
    ++counts_.num_turns;
    const std::string damage = damage_check_->verdict();
    set_trouble(damage.empty() ? dispatcher_.trouble() : damage);
    const std::lock_guard lock(mutex_);
    stats_ = counts_;
  }

  /// One transaction; who cleans up a store waits for its end.
  void decide() {
    const auto turn = turn_lock_.turn();
    const auto start = std::chrono::steady_clock::now();
    store_.begin();
    apply_orders();
    give_back_stall();
    apply_reports();
    planner_.go_on_with_footage();
    planner_.expand_one();
    dispatcher_.on_tick(clock_.monotonic_ms());
    planner_.end_finished_shots();
    store_.commit();
    counts_.turn_s.add(kTurnSeconds, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }

  /// Decides, then does what may only happen after the commit.

  /// What was decided, then what may only happen after its commit.
  void turn(Bus& bus) {
    decide();
    dispatcher_.flush(bus, http_address(), clock_.monotonic_ms());
    const auto effects = planner_.take_effects();
    publish(effects);
    show(effects);
    for (const Order& order : std::exchange(applied_, {})) order.succeed();
    store_.keep_journal_short();
    count_turn();
  }

  std::string http_address() const {
    const std::lock_guard lock(mutex_);
    return http_address_.empty() ? options_.http_address : http_address_;
  }

  void apply_orders() {
    std::vector<Order> orders;
    {
      const std::lock_guard lock(mutex_);
      orders = std::exchange(orders_, {});
    }
    for (Order& order : orders) {
      try {
        store_.guarded(order.apply);
        applied_.push_back(std::move(order));
      } catch (const DatabaseError& e) {  // the whole turn is undone, this order with it
        order.fail(std::make_exception_ptr(e));
        throw;
      } catch (const Error&) {
        order.fail(std::current_exception());
      }
    }
  }

  void apply_reports() {
    const std::int64_t until_ms = clock_.monotonic_ms() + kMaxCommitMs;
    for (int num = 0; !reports_.empty() && num < kMaxOperationsPerCommit && clock_.monotonic_ms() <= until_ms; ++num) {
      dispatcher_.on_report(reports_.front(), clock_.monotonic_ms());
      reports_.pop_front();
      ++counts_.num_reports;
    }
  }

  void publish(const Planner::Effects& effects) {
    try {
      for (const JobId id : effects.landed) {
        const JobRow job = *store_.job(id);
        if (is_good(job.state)) publish_job(store_.shot(job.shot)->folder, job);
      }
      for (const ShotId shot : effects.ended) {
        const ShotRow row = *store_.shot(shot);
        publish_shot(store_, shot, /*sweep=*/row.state == "done" && row.until_kind.empty());
      }
    } catch (const fs::filesystem_error& e) {  // results are safe in the store; only the links are missing
      spdlog::error("links: {}", e.what());
    }
  }

  /// At most every 100 ms, but at once for shots that ended or that somebody has just asked something of.
  void show(const Planner::Effects& effects) {
    to_show_.insert(effects.changed.begin(), effects.changed.end());
    std::set<ShotId> now(effects.ended);
    now.merge(std::exchange(ended_soon_, {}));
    const std::int64_t now_ms = clock_.monotonic_ms();
    if (now_ms - shown_ms_ >= kProgressMs) now.merge(to_show_), shown_ms_ = now_ms;
    for (const ShotId shot : now) {
      to_show_.erase(shot);
      refresh(shot);
    }
  }

  void refresh(ShotId shot) {
    auto fresh = read_progress(store_.db(), shot, kind_names(*options_.kinds));
    if (!fresh) return;
    fresh->num_workers = dispatcher_.num_live_workers();
    std::vector<std::function<void(const ShotProgress&)>> listeners;
    {
      const std::lock_guard lock(mutex_);
      progress_.insert_or_assign(shot, *fresh);
      listeners = listeners_;
    }
    changed_.notify_all();
    for (const auto& listener : listeners) listener(*fresh);
  }

  Options options_;
  fs::path state_dir_;
  LockFile lock_;
  TurnLock turn_lock_;
  Farm identity_;
  const Clock& clock_;
  Store store_;
  Planner planner_;
  Dispatcher dispatcher_;
  std::optional<Broker> broker_;
  std::optional<LcmEndpoint> endpoint_;
  WakeUp wake_up_;
  std::optional<SourceHasher> hasher_;
  // The scheduler's thread alone:
  std::deque<WorkerReport> reports_;
  std::vector<Order> applied_;  ///< wait for their commit
  std::set<ShotId> to_show_, ended_soon_;
  std::int64_t shown_ms_ = 0;
  std::int64_t looked_ms_ = 0, woken_ms_ = 0;       ///< monotonic
  std::int64_t retry_ms_ = 0, retry_pause_ms_ = 0;  ///< 0: the database can be written
  FarmStats counts_;
  std::optional<DamageCheck> damage_check_;
  // Everybody, under the mutex:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::string http_address_;
  std::vector<Order> orders_;
  std::map<ShotId, ShotProgress> progress_;
  std::vector<std::function<void(const ShotProgress&)>> listeners_;
  std::exception_ptr failure_;
  FarmHealth health_;
  FarmStats stats_;
  std::jthread thread_;  // last: stops before all else goes
};

FarmScheduler::FarmScheduler(Options options) : impl_(std::make_unique<Impl>(std::move(options))) {}
FarmScheduler::~FarmScheduler() = default;
const std::string& FarmScheduler::bus_url() const { return impl_->options().bus_url; }
fs::path FarmScheduler::key_file() const { return impl_->state_dir() / "farm.key"; }
fs::path FarmScheduler::state_dir() const { return impl_->state_dir(); }
FarmHealth FarmScheduler::health() const { return impl_->health(); }
FarmStats FarmScheduler::stats() const { return impl_->stats(); }
std::optional<Broker::Counts> FarmScheduler::broker_counts() const { return impl_->broker_counts(); }
DropCounts FarmScheduler::dropped_messages() const { return impl_->dropped_messages(); }
std::string FarmScheduler::farm_id() const { return impl_->farm_id(); }
void FarmScheduler::set_http_address(const std::string& address) { impl_->set_http_address(address); }

std::future<SubmitResult> FarmScheduler::submit(SubmitRequest request, OnceKey once) {
  return impl_->post<SubmitResult>([impl = impl_.get(), request = std::move(request), once = std::move(once)] {
    return impl->once<SubmitResult>(once, [&] { return impl->submit(request); });
  });
}
std::future<CommandResult> FarmScheduler::command(Command command, OnceKey once) {
  return impl_->post<CommandResult>([impl = impl_.get(), command = std::move(command), once = std::move(once)] {
    return impl->once<CommandResult>(once, [&] { return impl->command(command); });
  });
}
void FarmScheduler::note(const std::string& kind, const std::string& text) {
  impl_->post<bool>([impl = impl_.get(), kind, text] { return impl->note(kind, text); });
}
std::optional<ShotProgress> FarmScheduler::progress(ShotId shot) const { return impl_->progress(shot); }
std::vector<ShotProgress> FarmScheduler::all_progress() const { return impl_->all_progress(); }
void FarmScheduler::on_change(std::function<void(const ShotProgress&)> listener) {
  impl_->on_change(std::move(listener));
}
std::optional<ShotProgress> FarmScheduler::wait(ShotId shot, int timeout_ms) { return impl_->wait(shot, timeout_ms); }

}  // namespace vantage
