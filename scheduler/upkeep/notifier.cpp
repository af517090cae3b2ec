#include "scheduler/upkeep/notifier.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>

#include "scheduler/upkeep/bounded_program.h"
#include "scheduler/upkeep/web_client.h"
#include "schema/base/error.h"
#include "schema/base/hash.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr int kLongestPauseMs = 60'000;

/// False when the thread was asked to stop meanwhile.
bool pause(const std::stop_token& stop, int ms) {
  std::mutex mutex;
  std::condition_variable_any wake_up;
  std::unique_lock lock(mutex);
  wake_up.wait_for(lock, stop, std::chrono::milliseconds(ms), [] { return false; });
  return !stop.stop_requested();
}

std::string run_command(const FarmConfig::Notify& hook, const std::string& text) {
  const BoundedRun run = run_bounded(hook.command, text, hook.timeout_s * 1000);
  if (run.ok()) return "";
  const std::string line = run.output.substr(0, run.output.find('\n'));
  return run.timed_out ? fmt::format("{}: not done after {} s and ended", hook.command[0], hook.timeout_s)
                       : fmt::format("{}: exit code {}: {}", hook.command[0], run.exit_code, line);
}

/// The address may hold a secret after the host's name.
std::string host_of(const std::string& url) { return url.substr(0, url.find('/', url.find("://") + 3)); }

std::string call_webhook(const FarmConfig::Notify& hook, const std::string& text) {
  const WebAnswer answer = web_post_json(hook.webhook, text, hook.timeout_s * 1000);
  return answer.ok() ? "" : fmt::format("{}: {}", host_of(hook.webhook), answer.error);
}

}  // namespace

std::string tell(const FarmConfig::Notify& hook, const Json& facts) {
  return hook.webhook.empty() ? run_command(hook, facts.dump() + "\n") : call_webhook(hook, facts.dump());
}

Notifier::Notifier(Options options) : options_(std::move(options)) {
  if (options_.hooks.empty()) return;
  fs::create_directories(options_.state_dir / "notify");
  for (const FarmConfig::Notify& hook : options_.hooks)
    threads_.emplace_back([this, &hook](const std::stop_token& stop) { serve(hook, stop); });
}

Notifier::~Notifier() {
  for (auto& thread : threads_) thread.request_stop();
}

/// A name may hold any letters; a file's may not.
fs::path Notifier::cursor_file(const FarmConfig::Notify& hook) const {
  const bool plain = std::all_of(hook.name.begin(), hook.name.end(),
                                 [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; });
  return options_.state_dir / "notify" / ((plain ? hook.name : sha256_key(hook.name)) + ".json");
}

void Notifier::serve(const FarmConfig::Notify& hook, const std::stop_token& stop) {
  std::optional<std::int64_t> told_to;
  do {
    try {
      Sqlite db = open_farm_to_read(options_.state_dir);
      if (!told_to) told_to = first_cursor(hook, last_event(db));
      tell_all(hook, db, *told_to, stop);
    } catch (const std::exception& e) {  // the thread's boundary: tries again later
      spdlog::warn("notify {}: {}", hook.name, e.what());
    }
  } while (pause(stop, options_.look_every_ms));
}

/// A new hook hears of what happens from now on. A restored database may be behind what was told.
std::int64_t Notifier::first_cursor(const FarmConfig::Notify& hook, std::int64_t last) const {
  const fs::path file = cursor_file(hook);
  if (fs::exists(file)) return std::min(read_json(file).at("told_to").get<std::int64_t>(), last);
  write_json(file, {{"told_to", last}});
  return last;
}

void Notifier::tell_all(const FarmConfig::Notify& hook, Sqlite& db, std::int64_t& told_to,
                        const std::stop_token& stop) {
  for (;;) {
    const Happenings news = happenings_after(db, told_to);
    for (const Happening& happening : news.list) {
      if (std::find(hook.on.begin(), hook.on.end(), happening.event) == hook.on.end()) continue;
      if (!deliver(hook, happening, stop)) return;
      told_to = happening.id;
      write_json(cursor_file(hook), {{"told_to", told_to}});
    }
    if (news.seen_to <= told_to) return;
    told_to = news.seen_to;
  }
}

bool Notifier::deliver(const FarmConfig::Notify& hook, const Happening& happening, const std::stop_token& stop) {
  int pause_ms = options_.first_pause_ms;
  std::string why;
  for (int i = 1; i <= hook.tries; ++i) {
    why = tell(hook, happening.facts);
    if (why.empty()) return true;
    spdlog::warn("notify {}: {} (event {} of row {}, try {} of {})", hook.name, why, happening.event, happening.id, i,
                 hook.tries);
    if (i == hook.tries) break;
    if (!pause(stop, pause_ms)) return false;
    pause_ms = std::min(2 * pause_ms, kLongestPauseMs);
  }
  if (options_.on_trouble)
    options_.on_trouble(fmt::format("notify {}: {} was not taken: {}", hook.name, happening.event, why));
  return true;
}

}  // namespace vantage
