/// Planner: what people order. First who is meant, which changes nothing; then the change.
#include <fmt/format.h>

#include <algorithm>

#include "scheduler/plan/identity.h"
#include "scheduler/plan/planner.h"
#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"
#include "schema/formats/manifest.h"

namespace vantage {
namespace fs = std::filesystem;

void Planner::check_kind(const std::string& kind) const {
  const std::vector<std::string> names = kind_names(kinds_);
  if (std::find(names.begin(), names.end(), kind) != names.end()) return;
  throw Error(ErrorKind::BadInput, fmt::format("{}: there is no such stage{}; there are {}", kind,
                                               did_you_mean(kind, names), fmt::join(names, ", ")));
}

/// With a job go the bad ones that it needs, and the aborted ones that wait for nothing else bad.
std::vector<JobId> Planner::to_retry(const std::vector<JobId>& roots) {
  std::set<JobId> chosen;
  std::vector<JobId> open;
  const auto choose = [&](JobId id) {
    if (chosen.insert(id).second) open.push_back(id);
  };
  const auto is_chosen_or_no_obstacle = [&](JobId id) {
    return chosen.contains(id) || !is_bad(store_.brief(id)->state);
  };
  for (const JobId root : roots)
    if (is_bad(store_.brief(root)->state)) choose(root);
  while (!open.empty()) {
    const JobId id = open.back();
    open.pop_back();
    for (const JobId need : store_.needs_of(id))
      if (is_bad(store_.brief(need)->state)) choose(need);
    for (const JobId dependent : store_.dependents_of(id)) {
      if (store_.brief(dependent)->state != JobState::Aborted) continue;
      const auto needs = store_.needs_of(dependent);
      if (std::all_of(needs.begin(), needs.end(), is_chosen_or_no_obstacle)) choose(dependent);
    }
  }
  return {chosen.begin(), chosen.end()};
}

std::vector<JobId> Planner::all_dependents(const std::vector<JobId>& roots) {
  const std::set<JobId> given(roots.begin(), roots.end());
  std::set<JobId> found;
  std::vector<JobId> open = roots;
  while (!open.empty()) {
    const JobId id = open.back();
    open.pop_back();
    for (const JobId dependent : store_.dependents_of(id))
      if (!given.contains(dependent) && found.insert(dependent).second) open.push_back(dependent);
  }
  return {found.begin(), found.end()};
}

void Planner::retry(ShotId shot, const std::vector<JobId>& bad) {
  store_.set_shot_state(shot, "running", "");
  to_expand_.insert(shot);
  for (const JobId id : bad) {
    store_.set_retry(id, 0, 0, 0);
    store_.set_error(id, "", "");
    move(id, JobState::Blocked, "to be tried again");
  }
  settle_all(bad);
}

/// Those of the jobs whose needs are met.
void Planner::settle_all(const std::vector<JobId>& blocked) {
  for (const JobId id : blocked) {
    const JobRow job = *store_.job(id);
    if (job.num_unmet > 0 || job.state != JobState::Blocked) continue;
    settle(job);
    if (is_finished(store_.brief(id)->state)) finished(id);
  }
}

void Planner::cancel(const std::vector<JobId>& unfinished) {
  for (const JobId id : unfinished) {
    revoke(id);
    move(id, JobState::Canceled, "canceled by a person");
  }
  for (const JobId id : unfinished) finished(id);
}

void Planner::cancel(ShotId shot) {
  using enum JobState;
  cancel(store_.planned_in_states(shot, {Blocked, Ready, Leased, Running, Reconnect, Paused}));
  to_expand_.erase(shot);
  to_end_.insert(shot);
}

/// The artifact stays where it is until a worker is to make it again: then it is moved aside, and compared afterwards.
/// What needs it waits meanwhile, and is found by its key, not run, when the new artifact equals the old one.
void Planner::rerun(ShotId shot, const std::vector<JobId>& good) {
  store_.set_shot_state(shot, "running", "");
  if (plan_of(shot).asked.empty()) expand(shot, /*strict=*/true);  // the scheduler was started since it was planned
  Plan& plan = plan_of(shot);
  const auto plan_again_with = [&](const JobRow& job) {
    if (plan.asked.contains(job.name)) plan.missing.insert(job.name);
  };
  for (const JobId id : good) {
    const JobRow job = *store_.job(id);
    store_.add_suspect(job, store_.who());
    plan_again_with(job);
  }
  for (const JobId id : all_dependents(good)) {
    const JobRow job = *store_.job(id);
    plan_again_with(job);
    if (is_good(job.state) || is_active(job.state) || job.state == JobState::Ready)
      block(job.id, job.state, "what it needs is made again");
  }
  for (const JobId id : good) block(id, store_.brief(id)->state, "to be made again");
  settle_all(good);
}

void Planner::pause_stage(ShotId shot, const std::string& kind, const std::vector<JobId>& ready) {
  Store::StageSetting setting = store_.stage_setting(shot, kind);
  setting.paused = true;
  store_.set_stage_setting(shot, kind, setting);
  for (const JobId id : ready) move(id, JobState::Paused, "its stage is paused");
}

void Planner::resume_stage(ShotId shot, const std::string& kind, const std::vector<JobId>& paused) {
  Store::StageSetting setting = store_.stage_setting(shot, kind);
  setting.paused = false;
  store_.set_stage_setting(shot, kind, setting);
  for (const JobId id : paused) recheck(*store_.job(id));
}

JobRow Planner::make_ready_outside_plan(ShotId shot, const KindSpec& spec, const WorkUnit& unit) {
  const auto old = store_.find_job(shot, unit.name);
  if (old) block(old->id, old->state, "");
  JobRow row = old.value_or(JobRow{});
  row.shot = shot;
  row.name = unit.name;
  row.kind = spec.name;
  row.version = spec.version;
  row.params = unit.params.dump();
  row.unit = unit.unit.dump();
  row.sources = row.links = "[]";
  row.cores = unit.need.cores;
  row.ram_mb = unit.need.ram_mb;
  row.timeout_s = unit.need.timeout_s;
  if (old)
    store_.update_plan(row);
  else
    row.id = store_.insert_job(row);
  const JobFile file = job_file(row);
  make_ready(row, job_key(file), identity_of(file));
  return *store_.job(row.id);
}

bool Planner::is_suspect(const JobRow& job, const std::string& key) {
  const auto suspect = store_.suspect(job.shot, job.kind, key);
  return suspect && suspect->aside.empty();
}

bool Planner::move_suspect_aside(const JobRow& job) {
  if (!is_suspect(job, job.key)) return true;
  const fs::path folder = private_folder(job.shot);
  const fs::path artifact = artifact_folder(folder / "store", job.kind, job.key);
  const fs::path aside = folder / "aside" / fmt::format("{}-{}-{}", job.kind, job.key, store_.clock().wall_ms());
  std::error_code error;
  fs::create_directories(aside.parent_path(), error);
  if (!error && fs::exists(artifact, error)) fs::rename(artifact, aside, error);
  if (error) {
    const std::string why =
        fmt::format("{}: cannot be moved to {}: {}", artifact.string(), aside.string(), error.message());
    store_.set_error(job.id, std::string(to_string(ErrorKind::Transient)), why);
    move(job.id, JobState::Failed, why);
    finished(job.id);
    return false;
  }
  store_.set_suspect_aside(job, aside.string());
  return true;
}

void Planner::compare_with_suspect(const JobBrief& job, const std::string& key, const std::string& content) {
  const auto suspect = store_.suspect(job.shot, job.kind, key);
  if (!suspect || suspect->aside.empty()) return;
  store_.remove_suspect(job.shot, job.kind, key);
  if (suspect->content == content) {
    std::error_code ignored;  // a copy of what is in the store; `vantage gc` gets what could not be deleted
    fs::remove_all(suspect->aside, ignored);
    store_.add_event(job.shot, job.id, "", "decision", fmt::format("{}: made again, it is the same", job.name));
  } else {
    store_.add_event(
        job.shot, job.id, "", "warning",
        fmt::format("{}: made again, it differs: the first one was damaged, or the job's result depends on "
                    "more than its inputs. The first one is kept in {}",
                    job.name, suspect->aside));
  }
}

}  // namespace vantage
