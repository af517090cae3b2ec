/// Planner's other half: what becomes of single jobs.
#include <fmt/format.h>

#include <algorithm>

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

JobFile Planner::job_file(const JobRow& job) {
  JobFile file;
  file.kind = job.kind;
  file.version = job.version;
  file.job = job.name;
  file.shot = store_.shot(job.shot)->name;
  file.key = job.key;
  file.params = Json::parse(job.params);
  file.unit = Json::parse(job.unit);
  file.store = private_folder(job.shot) / "store";
  file.cores = job.cores;
  file.ram_mb = job.ram_mb;
  file.timeout_s = job.timeout_s;
  for (const JobId id : store_.needs_of(job.id)) {
    const JobRow need = *store_.job(id);
    file.inputs[need.name] = {artifact_folder(file.store, need.kind, need.key), need.content};
  }
  for (const Json& source : Json::parse(job.sources)) {
    const fs::path path = source.at("path").get<std::string>();
    file.sources[source.at("name")] = {path, store_.source_hash(path)};
  }
  return file;
}

void Planner::move(const JobRow& job, JobState to, const std::string& reason) {
  store_.move(job.id, to, reason);
  effects_.changed.insert(job.shot);
  if (is_good(to)) effects_.landed.push_back(job.id);
}

/// All needs are met: is the job done already, by key? Else it is ready, and says why.
void Planner::settle(const JobRow& job) {
  JobFile file;
  try {
    file = job_file(job);
  } catch (const Error& e) {
    if (e.kind() == ErrorKind::Bug) throw;
    revoke(job.id);
    block(job, "");
    store_.set_error(job.id, std::string(to_string(e.kind())), e.what());
    move(job, JobState::Failed, e.what());
    return;
  }
  const std::string key = job_key(file);
  const Json identity = identity_of(file);
  if (is_active(job.state)) {
    if (key == job.key) return;
    revoke(job.id);
  }
  const auto manifest = read_valid_manifest(artifact_folder(file.store, job.kind, key));
  if (!manifest || is_suspect(job, key)) {
    make_ready(job, key, identity);
    return;
  }
  compare_with_suspect(job, key, manifest->content);
  const bool unchanged = is_good(job.state) && key == job.key && manifest->content == job.content;
  if (unchanged) return;
  store_.set_key(job.id, key, identity.dump());
  store_.set_content(job.id, manifest->content);
  store_.set_error(job.id, "", "");
  move(job, JobState::Skipped, "up to date");
}

void Planner::make_ready(const JobRow& job, const std::string& key, const Json& identity) {
  const std::string reason = is_suspect(job, key) ? "asked for again by a person" : why_it_runs(job, key, identity);
  if (key != job.key || is_bad(job.state)) {
    store_.set_retry(job.id, 0, 0, 0);
    store_.set_error(job.id, "", "");
  }
  store_.set_key(job.id, key, identity.dump());
  store_.set_content(job.id, "");
  move(job, JobState::Ready, reason);
  if (store_.stage_setting(job.shot, job.kind).paused)
    move(*store_.job(job.id), JobState::Paused, "its stage is paused");
}

bool Planner::salvage(const JobRow& job, JobState to, const std::string& reason) {
  if (job.key.empty()) return false;
  const auto manifest = read_valid_manifest(artifact_folder(private_folder(job.shot) / "store", job.kind, job.key));
  if (!manifest || is_suspect(job, job.key)) return false;
  compare_with_suspect(job, job.key, manifest->content);
  store_.set_content(job.id, manifest->content);
  store_.set_error(job.id, "", "");
  move(job, to, reason);
  finished(job.id);
  return true;
}

void Planner::finished(JobId id) {
  open_.push_back(id);
  if (closing_) return;
  closing_ = true;
  while (!open_.empty()) {
    const JobRow job = *store_.job(open_.back());
    open_.pop_back();
    effects_.changed.insert(job.shot);
    to_end_.insert(job.shot);
    if (is_bad(job.state)) abort_dependents(job);
    if (!is_good(job.state)) continue;
    effects_.landed.push_back(job.id);
    settle_dependents(job.id);
    const auto plan = plans_.find(job.shot);
    if (plan != plans_.end() && plan->second.missing.contains(job.name)) to_expand_.insert(job.shot);
  }
  closing_ = false;
}

/// Also those that were aborted for want of this one: a result may come after all.
void Planner::settle_dependents(JobId id) {
  for (const JobId dependent_id : store_.dependents_of(id)) {
    const JobRow dependent = *store_.job(dependent_id);
    const bool waits = dependent.state == JobState::Blocked || dependent.state == JobState::Aborted;
    if (!waits || dependent.num_unmet > 0) continue;
    settle(dependent);
    if (is_finished(store_.job(dependent_id)->state)) finished(dependent_id);
  }
}

void Planner::abort_dependents(const JobRow& root) {
  std::vector<JobId> open{root.id};
  while (!open.empty()) {
    const JobId need = open.back();
    open.pop_back();
    for (const JobId id : store_.dependents_of(need)) {
      const JobRow job = *store_.job(id);
      if (is_bad(job.state)) continue;
      block(job, "");
      move(job, JobState::Aborted, fmt::format("needs {}, which is {}", root.name, to_string(root.state)));
      open.push_back(id);
    }
  }
}

void Planner::block(const JobRow& job, const std::string& reason) {
  if (is_active(job.state)) revoke(job.id);
  if (job.state != JobState::Blocked) move(job, JobState::Blocked, reason);
}

void Planner::revoke(JobId job) {
  for (const AttemptRow& attempt : store_.open_attempts_of(job)) {
    store_.end_attempt(attempt.ref, "canceled", {});
    revoked_.push_back(attempt);
  }
}

void Planner::recheck(const JobRow& job) {
  if (job.state == JobState::Paused) move(job, JobState::Blocked, "resumed");
  const JobRow now = *store_.job(job.id);
  if (now.num_unmet > 0) return;
  settle(now);
  if (is_finished(store_.job(job.id)->state)) finished(job.id);
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
