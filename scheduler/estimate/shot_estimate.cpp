#include "scheduler/estimate/shot_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

#include "scheduler/store/job_state.h"

namespace vantage {
namespace {

/// Newer jobs tell more of what comes than older ones, and so many say enough.
constexpr int kMaxSamples = 200, kMaxEarlierShots = 5;
/// The chain of single jobs is looked for up to here; above, jobs are taken together without reading who needs whom.
constexpr std::int64_t kMaxJobsLinked = 20'000;

using Counts = std::map<std::string, int>;  ///< planned jobs by kind

class Reader {
 public:
  Reader(Sqlite& db, ShotId shot, std::int64_t generation, std::string until_kind, bool plan_may_grow,
         std::int64_t now_ms)
      : db_(db),
        shot_(shot),
        generation_(generation),
        until_kind_(std::move(until_kind)),
        plan_may_grow_(plan_may_grow),
        now_ms_(now_ms) {}

  std::vector<KindKnowledge> knowledge(const std::vector<std::string>& kind_names) {
    const std::vector<std::int64_t> earlier = earlier_shots();
    const Counts here = counts(shot_.value);
    std::vector<Counts> there;
    for (const auto shot : earlier) there.push_back(counts(shot));
    std::vector<KindKnowledge> kinds;
    bool wanted = true;
    for (const std::string& name : kind_names) {
      KindKnowledge known{.kind = name};
      known.stats = duration_stats(durations(shot_.value, name));
      for (std::size_t i = 0; i < earlier.size() && known.stats.num == 0; ++i) {
        known.stats = duration_stats(durations(earlier[i], name));
        known.other_shots = known.stats.num > 0;
      }
      if (wanted && plan_may_grow_ && !here.contains(name)) known.num_unplanned = expected_number(name, here, there);
      wanted &= name != until_kind_;
      kinds.push_back(std::move(known));
    }
    return kinds;
  }

  Capacity capacity() {
    Query q = db_.query("SELECT coalesce(sum(slots), 0), coalesce(sum(cores), 0) FROM worker WHERE state = 'active'");
    q.step();
    return {.num_slots = static_cast<int>(q.integer(0)), .num_cores = static_cast<int>(q.integer(1))};
  }

  std::int64_t num_unfinished() {
    return db_.integer_or(0,
                          "SELECT coalesce(sum(num), 0) FROM job_count WHERE shot_id = ? "
                          "AND state IN ('blocked', 'ready', 'leased', 'running', 'reconnect', 'paused')",
                          shot_.value);
  }

  struct Job {
    ShotEstimate::PathJob row{};
    WorkItem item{};
  };
  /// Needs first; ids of jobs rise along the plan, but a new plan may put an old job behind a new one.
  std::vector<Job> linked_jobs(const std::vector<std::string>& kind_names);
  /// One kind after the other, taken together; each kind follows the one before it in step.
  std::vector<WorkItem> items_by_kind(const std::vector<std::string>& kind_names);

 private:
  std::vector<std::int64_t> earlier_shots() {
    std::vector<std::int64_t> shots;
    for (Query q = db_.query("SELECT id FROM shot WHERE id <> ? ORDER BY submitted_ms DESC LIMIT ?", shot_.value,
                             kMaxEarlierShots);
         q.step();)
      shots.push_back(q.integer(0));
    return shots;
  }

  Counts counts(std::int64_t shot) {
    Counts out;
    for (Query q = db_.query("SELECT kind, sum(num) FROM job_count WHERE shot_id = ? GROUP BY kind HAVING sum(num) > 0",
                             shot);
         q.step();)
      out[q.text(0)] = static_cast<int>(q.integer(1));
    return out;
  }

  std::vector<double> durations(std::int64_t shot, const std::string& kind) {
    std::vector<double> out;
    for (Query q = db_.query("SELECT wall_ms FROM job WHERE shot_id = ?1 AND generation = (SELECT generation FROM shot "
                             "WHERE id = ?1) AND kind = ?2 AND state = 'done' ORDER BY id DESC LIMIT ?3",
                             shot, kind, kMaxSamples);
         q.step();)
      if (q.integer(0) > 0) out.push_back(static_cast<double>(q.integer(0)) / 1000);
    return out;
  }

  /// As many per job of the latest kind that both shots have as in the newest shot that tells.
  static std::optional<int> expected_number(const std::string& kind, const Counts& here,
                                            const std::vector<Counts>& there) {
    for (const Counts& earlier : there) {
      if (earlier.empty()) continue;
      double most = 0, ratio = 0;
      for (const auto& [known, num] : here)
        if (const auto same = earlier.find(known); same != earlier.end() && same->second >= most)
          most = same->second, ratio = static_cast<double>(num) / same->second;
      const auto found = earlier.find(kind);
      if (ratio > 0) return found == earlier.end() ? 0 : static_cast<int>(std::ceil(ratio * found->second));
    }
    return std::nullopt;
  }

  Sqlite& db_;
  ShotId shot_;
  std::int64_t generation_;
  std::string until_kind_;
  bool plan_may_grow_;
  std::int64_t now_ms_;
};

std::vector<Reader::Job> Reader::linked_jobs(const std::vector<std::string>& kind_names) {
  std::unordered_map<std::string, int> kind_index;
  for (std::size_t i = 0; i < kind_names.size(); ++i) kind_index[kind_names[i]] = static_cast<int>(i);
  std::vector<Job> jobs;
  std::unordered_map<std::int64_t, int> index;
  for (Query q = db_.query(
           "SELECT job.id, name, kind, job.state, job.cores, (SELECT max(started_ms) FROM attempt WHERE job_id = "
           "job.id "
           "AND attempt.state = 'running') FROM job WHERE shot_id = ? AND generation = ? "
           "AND job.state IN ('blocked', 'ready', 'leased', 'running', 'reconnect', 'paused') ORDER BY stage, job.id",
           shot_.value, generation_);
       q.step();) {
    const auto kind = kind_index.find(q.text(2));
    if (kind == kind_index.end()) continue;
    index[q.integer(0)] = static_cast<int>(jobs.size());
    WorkItem item{.kind = kind->second, .cores = static_cast<int>(q.integer(4))};
    if (!q.is_null(5)) item.elapsed_s = std::max(0.0, static_cast<double>(now_ms_ - q.integer(5)) / 1000);
    jobs.push_back({.row = {.id = {q.integer(0)}, .name = q.text(1), .state = q.text(3)}, .item = std::move(item)});
  }
  for (Query q = db_.query("SELECT d.job_id, d.needs_id FROM job JOIN dependency d ON d.job_id = job.id "
                           "WHERE shot_id = ? AND generation = ? AND job.state IN ('blocked', 'paused')",
                           shot_.value, generation_);
       q.step();) {
    const auto job = index.find(q.integer(0)), need = index.find(q.integer(1));
    if (job != index.end() && need != index.end() && need->second < job->second)
      jobs[static_cast<std::size_t>(job->second)].item.needs.push_back(need->second);
  }
  return jobs;
}

std::vector<WorkItem> Reader::items_by_kind(const std::vector<std::string>& kind_names) {
  std::map<std::string, std::int64_t> num_left;
  for (Query q =
           db_.query("SELECT kind, sum(num) FROM job_count WHERE shot_id = ? AND num > 0 "
                     "AND state IN ('blocked', 'ready', 'leased', 'running', 'reconnect', 'paused') GROUP BY kind",
                     shot_.value);
       q.step();)
    num_left[q.text(0)] = q.integer(1);
  const std::int64_t num_kinds = std::max<std::int64_t>(1, static_cast<std::int64_t>(num_left.size()));
  const std::int64_t max_items = static_cast<std::int64_t>(kMaxItems) / num_kinds;
  std::vector<WorkItem> items;
  std::vector<int> before;
  for (std::size_t kind = 0; kind < kind_names.size(); ++kind) {
    const auto found = num_left.find(kind_names[kind]);
    if (found == num_left.end()) continue;
    const std::int64_t num = found->second, num_items = std::min(num, max_items);
    std::vector<int> made;
    for (std::int64_t i = 0; i < num_items; ++i) {
      WorkItem item{.kind = static_cast<int>(kind)};
      item.num_jobs = static_cast<int>((i + 1) * num / num_items - i * num / num_items);
      if (!before.empty())
        item.needs = {before[std::min(
            before.size() - 1, before.size() * static_cast<std::size_t>(i + 1) / static_cast<std::size_t>(num_items))]};
      made.push_back(static_cast<int>(items.size()));
      items.push_back(std::move(item));
    }
    before = made;
  }
  return items;
}

/// Jobs of one kind that stand side by side, taken together until there are at most kMaxItems.
std::vector<WorkItem> taken_together(const std::vector<WorkItem>& items) {
  const std::size_t size = (items.size() + kMaxItems - 1) / kMaxItems;
  if (size <= 1) return items;
  std::vector<WorkItem> out;
  std::vector<int> group(items.size());
  std::size_t in_last = 0;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const WorkItem& item = items[i];
    const bool joins = !out.empty() && in_last < size && out.back().kind == item.kind && item.elapsed_s < 0 &&
                       out.back().elapsed_s < 0;
    if (!joins) out.push_back({.kind = item.kind, .num_jobs = 0, .cores = item.cores, .elapsed_s = item.elapsed_s});
    in_last = joins ? in_last + 1 : 1;
    ++out.back().num_jobs;
    group[i] = static_cast<int>(out.size()) - 1;
    for (const int need : item.needs)
      if (const int other = group[static_cast<std::size_t>(need)]; other != group[i]) out.back().needs.push_back(other);
  }
  for (WorkItem& item : out) {
    std::sort(item.needs.begin(), item.needs.end());
    item.needs.erase(std::unique(item.needs.begin(), item.needs.end()), item.needs.end());
  }
  return out;
}

std::string why_not(const EstimateInput& input) {
  if (input.capacity.num_slots <= 0) return "no worker takes work";
  return "no job of what is left has been timed yet";
}

}  // namespace

std::optional<ShotEstimate> estimate_shot(Sqlite& db, ShotId shot, const std::vector<std::string>& kind_names,
                                          std::int64_t now_ms) {
  std::optional<Reader> reader;
  {
    Query q = db.query("SELECT generation, until_kind, num_awaited, state FROM shot WHERE id = ?", shot.value);
    if (!q.step() || (q.text(3) != "running" && q.text(3) != "paused")) return std::nullopt;
    reader.emplace(db, shot, q.integer(0), q.text(1), q.integer(2) > 0, now_ms);
  }
  ShotEstimate out;
  EstimateInput input{.kinds = reader->knowledge(kind_names), .items = {}, .capacity = reader->capacity()};
  if (reader->num_unfinished() > kMaxJobsLinked) {
    input.items = reader->items_by_kind(kind_names);
  } else {
    const auto jobs = reader->linked_jobs(kind_names);
    for (const auto& job : jobs) input.items.push_back(job.item);
    const CriticalPath path = critical_path(input.items, input.kinds);
    out.critical_path_s = path.length_s;
    for (const int i : path.items) out.critical_path.push_back(jobs[static_cast<std::size_t>(i)].row);
    input.items = taken_together(input.items);
  }
  out.rest = estimate_rest(input);
  if (!out.rest) out.why = why_not(input);
  return out;
}

}  // namespace vantage
