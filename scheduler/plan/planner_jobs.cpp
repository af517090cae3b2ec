/// Planner's other half: what becomes of single jobs.
#include <fmt/format.h>

#include <algorithm>

#include "jobs/probe/selftest_job.h"
#include "scheduler/plan/footage_unread.h"
#include "scheduler/plan/identity.h"
#include "scheduler/plan/planner.h"
#include "schema/base/error.h"
#include "schema/formats/manifest.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

std::string why_it_runs(const JobRow& job, const std::string& key, const Json& identity) {
  if (job.identity.empty()) return "first run";
  if (key != job.key) return explain_change(Json::parse(job.identity), identity);
  if (!job.content.empty()) return "output missing";
  return job.num_attempts > 0 ? "tried again" : "first run";
}

}  // namespace

const KindSpec* Planner::spec_of(const std::string& kind) const {
  static const KindSpec selftest = SelfTestJob::spec();
  if (kind == selftest.name) return &selftest;
  const auto entry = std::find_if(kinds_.begin(), kinds_.end(), [&](const auto& k) { return k.spec.name == kind; });
  return entry == kinds_.end() ? nullptr : &entry->spec;
}

bool Planner::publishes(const std::string& kind) const {
  const KindSpec* spec = spec_of(kind);
  return spec == nullptr || !spec->publishes.empty();
}

bool Planner::runs_in_worker(const std::string& kind) const {
  const KindSpec* spec = spec_of(kind);
  return spec != nullptr && spec->in_worker;
}

bool Planner::key_holds(const JobRow& job) { return job.sources == "[]" || job_key(job_file(job)) == job.key; }

JobFile Planner::job_file(const JobRow& job) {
  JobFile file;
  file.kind = job.kind;
  file.version = job.version;
  file.job = job.name;
  const ShotRow shot = *store_.shot(job.shot);
  file.shot = shot.name;
  file.key = job.key;
  file.params = Json::parse(job.params);
  file.unit = Json::parse(job.unit);
  file.store = shot.folder / ".vantage" / "store";
  file.cores = job.cores;
  file.ram_mb = job.ram_mb;
  file.timeout_s = job.timeout_s;
  for (const JobId id : store_.needs_of(job.id)) {
    const JobRow need = *store_.job(id);
    file.inputs[need.name] = {artifact_folder(file.store, need.kind, need.key), need.content};
  }
  for (const Json& source : Json::parse(job.sources)) {
    const fs::path path = source.at("path").get<std::string>();
    file.sources[source.at("name")] = {path, source_hash(path)};
  }
  return file;
}

void Planner::move(JobId job, JobState to, const std::string& reason) {
  store_.move(job, to, reason);
  moved(job, store_.brief(job)->shot, to);
}

void Planner::moved(JobId job, ShotId shot, JobState to) {
  effects_.changed.insert(shot);
  if (is_good(to)) effects_.landed.push_back(job);
}

/// All needs are met: is the job done already, by key? Else it is ready, and says why.
void Planner::settle(const JobRow& job) {
  JobFile file;
  try {
    file = job_file(job);
  } catch (const DatabaseError&) {
    throw;
  } catch (const FootageUnread& e) {
    wait_for_footage(job, e.path());
    return;
  } catch (const Error& e) {
    if (e.kind() == ErrorKind::Bug) throw;
    revoke(job.id);
    block(job.id, job.state, "");
    store_.set_error(job.id, std::string(to_string(e.kind())), e.what());
    move(job.id, JobState::Failed, e.what());
    return;
  }
  const std::string key = job_key(file);
  const Json identity = identity_of(file);
  if (is_active(job.state)) {
    if (key == job.key) return;
    revoke(job.id);
  }
  const auto content = content_of(job, key);
  if (!content || is_suspect(job, key)) {
    make_ready(job, key, identity);
    return;
  }
  compare_with_suspect(*store_.brief(job.id), key, *content);
  const bool unchanged = is_good(job.state) && key == job.key && *content == job.content;
  if (unchanged) return;
  store_.set_error(job.id, "", "");
  store_.move_with_key(job.id, JobState::Skipped, "up to date",
                       {.key = key, .identity = identity.dump(), .content = *content});
  moved(job.id, job.shot, JobState::Skipped);
}

/// Content hash of what an earlier attempt left for the key. What leaves nothing behind is done when its row says so.
std::optional<std::string> Planner::content_of(const JobRow& job, const std::string& key) {
  if (!publishes(job.kind)) return is_good(job.state) && key == job.key ? std::optional(job.content) : std::nullopt;
  const auto manifest = read_valid_manifest(artifact_folder(private_folder(job.shot) / "store", job.kind, key));
  return manifest ? std::optional(manifest->content) : std::nullopt;
}

std::optional<std::string> Planner::content_made(const JobBrief& job) {
  if (!publishes(job.kind)) return std::string(kNothingPublished);
  const auto manifest = read_valid_manifest(artifact_folder(private_folder(job.shot) / "store", job.kind, job.key));
  return manifest ? std::optional(manifest->content) : std::nullopt;
}

void Planner::make_ready(const JobRow& job, const std::string& key, const Json& identity) {
  const std::string reason = is_suspect(job, key) ? "asked for again by a person" : why_it_runs(job, key, identity);
  const bool forget = (key != job.key && !job.key.empty()) || is_bad(job.state);
  store_.move_with_key(job.id, JobState::Ready, reason,
                       {.key = key, .identity = identity.dump(), .content = "", .forget_failures = forget});
  moved(job.id, job.shot, JobState::Ready);
  if (store_.stage_setting(job.shot, job.kind).paused) move(job.id, JobState::Paused, "its stage is paused");
}

bool Planner::salvage(const JobRow& job, JobState to, const std::string& reason) {
  if (job.key.empty()) return false;
  const auto content = content_of(job, job.key);
  if (!content || is_suspect(job, job.key)) return false;
  compare_with_suspect(*store_.brief(job.id), job.key, *content);
  store_.set_content(job.id, *content);
  store_.set_error(job.id, "", "");
  move(job.id, to, reason);
  finished(job.id);
  return true;
}

void Planner::finished(JobId id) {
  open_.push_back(id);
  if (closing_) return;
  closing_ = true;
  while (!open_.empty()) {
    const JobBrief job = *store_.brief(open_.back());
    open_.pop_back();
    effects_.changed.insert(job.shot);
    to_end_.insert(job.shot);
    if (is_bad(job.state)) abort_dependents(job);
    if (!is_good(job.state)) continue;
    if (job.has_links) effects_.landed.push_back(job.id);
    settle_dependents(job.id);
    const auto plan = plans_.find(job.shot);
    if (plan != plans_.end() && plan->second.missing.contains(job.name)) to_expand_.insert(job.shot);
  }
  closing_ = false;
}

/// Also those that were aborted for want of this one: a result may come after all.
void Planner::settle_dependents(JobId id) {
  for (const JobId dependent_id : store_.dependents_of(id)) {
    const JobBrief dependent = *store_.brief(dependent_id);
    const bool waits = dependent.state == JobState::Blocked || dependent.state == JobState::Aborted;
    if (!waits || dependent.num_unmet > 0) continue;
    settle(*store_.job(dependent_id));
    if (is_finished(store_.brief(dependent_id)->state)) finished(dependent_id);
  }
}

void Planner::abort_dependents(const JobBrief& root) {
  std::vector<JobId> open{root.id};
  while (!open.empty()) {
    const JobId need = open.back();
    open.pop_back();
    for (const JobId id : store_.dependents_of(need)) {
      const JobBrief job = *store_.brief(id);
      if (is_bad(job.state)) continue;
      block(job.id, job.state, "");
      move(job.id, JobState::Aborted, fmt::format("needs {}, which is {}", root.name, to_string(root.state)));
      open.push_back(id);
    }
  }
}

void Planner::block(JobId job, JobState state, const std::string& reason) {
  if (is_active(state)) revoke(job);
  if (state != JobState::Blocked) move(job, JobState::Blocked, reason);
}

void Planner::revoke(JobId job) {
  for (const AttemptRow& attempt : store_.open_attempts_of(job)) {
    store_.end_attempt(attempt.ref, "canceled", {});
    revoked_.push_back(attempt);
  }
}

void Planner::recheck(const JobRow& job) {
  if (job.state == JobState::Paused) move(job.id, JobState::Blocked, "resumed");
  const JobRow now = *store_.job(job.id);
  if (now.num_unmet > 0) return;
  settle(now);
  if (is_finished(store_.brief(job.id)->state)) finished(job.id);
}

void Planner::end_finished_shots() {
  for (const ShotId shot : std::exchange(to_end_, {})) {
    const ShotRow row = *store_.shot(shot);
    const bool open = row.state == "running" || row.state == "paused";
    if (!open || to_expand_.contains(shot) || store_.has_planned_unfinished(shot)) continue;
    const bool failed = !row.error.empty() || store_.num_planned_bad(shot) > 0;
    store_.set_shot_state(shot, failed ? "failed" : "done", row.error);
    effects_.changed.insert(shot);
    effects_.ended.insert(shot);
  }
}

}  // namespace vantage
