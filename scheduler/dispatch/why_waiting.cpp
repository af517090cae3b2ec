#include "scheduler/dispatch/why_waiting.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <sstream>
#include <vector>

#include "scheduler/dispatch/worker_table.h"

namespace vantage {
namespace {

struct Waiting {
  std::string kind, pool, tags, shot_state, shot;
  int version = 0;
  std::int64_t not_before_ms = 0;
  bool crashed = false;
  Wanted wanted() const { return {.kind = kind, .pool = pool, .tags = tags, .version = version}; }
};

struct Known {
  LiveWorker worker;  ///< as far as its row tells
  std::string state;
};

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

std::optional<Waiting> read_waiting(Sqlite& db, JobId job) {
  Query q = db.query(
      "SELECT kind, job.pool, job.tags, shot.state, shot.name, version, not_before_ms, num_crashes, job.state FROM job "
      "JOIN shot ON shot.id = shot_id WHERE job.id = ?",
      job.value);
  if (!q.step() || q.text(8) != "ready") return std::nullopt;
  return Waiting{.kind = q.text(0),
                 .pool = q.text(1),
                 .tags = q.text(2),
                 .shot_state = q.text(3),
                 .shot = q.text(4),
                 .version = static_cast<int>(q.integer(5)),
                 .not_before_ms = q.integer(6),
                 .crashed = q.integer(7) > 0};
}

std::vector<Known> read_workers(Sqlite& db) {
  std::vector<Known> workers;
  for (Query q = db.query("SELECT id, pool, tags, kinds, state FROM worker ORDER BY id"); q.step();) {
    Known known{.worker = {}, .state = q.text(4)};
    known.worker.report.worker_id = q.text(0);
    known.worker.report.pool = q.text(1);
    known.worker.report.tags = words_of(q.text(2));
    known.worker.report.kinds = words_of(q.text(3));
    workers.push_back(std::move(known));
  }
  return workers;
}

/// "a worker of pool 'night' with tags 'bigmem', 'gpu' that can run depth/3"
std::string asked_for(const Waiting& w) {
  std::string text = "a worker";
  if (!w.pool.empty()) text += fmt::format(" of pool '{}'", w.pool);
  if (const auto tags = words_of(w.tags); !tags.empty())
    text += fmt::format(" with tag{} '{}'", tags.size() == 1 ? "" : "s", fmt::join(tags, "', '"));
  return text + fmt::format(" that can run {}/{}", w.kind, w.version);
}

/// "2 draining, 1 lost"
std::string states_text(const std::map<std::string, int>& num_by_state) {
  std::vector<std::string> parts;
  for (const auto& [state, num] : num_by_state) parts.push_back(fmt::format("{} {}", num, state));
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string nobody(const Waiting& w, const std::vector<Known>& workers) {
  std::map<std::string, int> would_do, of_pool;
  for (const Known& known : workers) {
    if (known.worker.serves(w.wanted())) ++would_do[known.state];
    if (known.worker.report.pool == w.pool) ++of_pool[known.state];
  }
  const std::string text = fmt::format("waits for {}: ", asked_for(w));
  if (workers.empty()) return text + "no worker has ever reported";
  if (!would_do.empty()) return text + fmt::format("none takes work ({})", states_text(would_do));
  if (!w.pool.empty() && of_pool.empty()) return text + "no worker is of that pool";
  if (!w.pool.empty()) return text + fmt::format("none of that pool fits ({})", states_text(of_pool));
  return text + "no worker fits";
}

}  // namespace

std::string why_waiting(Sqlite& db, JobId job, std::int64_t now_ms) {
  const auto waiting = read_waiting(db, job);
  if (!waiting) return "";
  if (waiting->shot_state == "paused") return fmt::format("waits: {} is paused", waiting->shot);
  if (waiting->not_before_ms > now_ms)
    return fmt::format("waits {:.0f} s before its next try",
                       static_cast<double>(waiting->not_before_ms - now_ms) / 1000);
  const auto workers = read_workers(db);
  const auto takes_it = [&](const Known& known) {
    return known.state == "active" && known.worker.serves(waiting->wanted());
  };
  const auto num = std::count_if(workers.begin(), workers.end(), takes_it);
  if (num == 0) return nobody(*waiting, workers);
  if (waiting->crashed)
    return fmt::format("waits for {} that is empty, to run alone after a crash", asked_for(*waiting));
  return fmt::format("waits for a free slot: {} worker{} can take it", num, num == 1 ? "" : "s");
}

}  // namespace vantage
