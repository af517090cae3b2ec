#include "scheduler/plan/planner.h"

#include <fmt/format.h>

#include <algorithm>

#include "jobs/probe/selftest_job.h"
#include "scheduler/plan/identity.h"
#include "schema/base/error.h"
#include "schema/formats/manifest.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

std::string sources_text(const WorkUnit& unit) {
  Json out = Json::array();
  for (const auto& source : unit.sources) out.push_back({{"name", source.name}, {"path", source.path.string()}});
  return out.dump();
}

std::string links_text(const WorkUnit& unit) {
  Json out = Json::array();
  for (const auto& link : unit.links) out.push_back({{"from", link.from}, {"to", link.to}});
  return out.dump();
}

}  // namespace

Planner::Submitted Planner::submit(const fs::path& folder, const std::string& until_kind, int priority) {
  const std::vector<std::string> names = kind_names(kinds_);
  if (!until_kind.empty()) check_kind(until_kind);
  Plan plan{.shot = read_shot(folder, names), .until_kind = until_kind};
  for (const auto& kind : kinds_) kind.check(plan.shot);

  const ShotRow row = store_.submit_shot(plan.shot.folder, plan.shot.name, until_kind, priority);
  plan.generation = row.generation;
  auto previous = plans_.extract(row.id);
  const Effects effects_before = effects_;
  const auto revoked_before = revoked_;
  plans_.insert_or_assign(row.id, std::move(plan));
  try {
    expand(row.id, /*strict=*/true);
  } catch (...) {  // the caller undoes the rows; this undoes the rest
    plans_.erase(row.id);
    if (previous) plans_.emplace(row.id, std::move(previous.mapped()));
    effects_ = effects_before;
    revoked_ = revoked_before;
    throw;
  }
  const auto planned = store_.num_planned(row.id);
  return {.shot = row, .num_jobs = planned.all, .num_up_to_date = planned.good};
}

void Planner::resume() {
  plans_.clear();
  wait_for_footage_.clear();
  to_expand_.clear();
  to_end_.clear();
  open_.clear();
  closing_ = false;
  effects_ = {};
  revoked_.clear();
  for (const std::string state : {"running", "paused"})
    for (const ShotRow& row : store_.shots_in_state(state)) to_expand_.insert(row.id);
}

Planner::Plan Planner::read_plan(const ShotRow& row) {
  Plan plan{
      .shot = read_shot(row.folder, kind_names(kinds_)), .until_kind = row.until_kind, .generation = row.generation};
  for (const auto& kind : kinds_) kind.check(plan.shot);
  return plan;
}

Planner::Plan& Planner::plan_of(ShotId shot) {
  const auto found = plans_.find(shot);
  if (found != plans_.end()) return found->second;
  return plans_.emplace(shot, read_plan(*store_.shot(shot))).first->second;
}

std::optional<fs::path> Planner::artifact_of(ShotId shot, const std::string& name) {
  const auto job = store_.find_job(shot, name);  // of a kind that publishes nothing: a folder that is not there
  if (!job || !is_good(job->state) || job->generation != plans_.at(shot).generation) return std::nullopt;
  return artifact_folder(private_folder(shot) / "store", job->kind, job->key);
}

fs::path Planner::private_folder(ShotId shot) { return store_.shot(shot)->folder / ".vantage"; }

void Planner::expand(ShotId shot, bool strict) {
  Plan& plan = plan_of(shot);
  const auto lookup = [&](const std::string& job) { return artifact_of(shot, job); };
  ShotPlan wanted;
  do {  // each pass may find artifacts that are up to date and so let later kinds be planned; kinds are finite
    wanted = plan_shot(plan.shot, kinds_, plan.until_kind, lookup);
    if (strict && !wanted.errors.empty()) throw Error(ErrorKind::BadInput, wanted.errors.begin()->second);
    apply(shot, plan, wanted);
  } while (std::any_of(wanted.missing.begin(), wanted.missing.end(),
                       [&](const auto& job) { return lookup(job).has_value(); }));
  plan.asked = wanted.asked;
  store_.set_num_awaited(shot, static_cast<int>(wanted.missing.size()));
  plan.missing = wanted.missing;
  const std::string error = wanted.errors.empty() ? "" : wanted.errors.begin()->second;
  const ShotRow row = *store_.shot(shot);
  if (error != row.error) store_.set_shot_state(shot, row.state, error);
  effects_.changed.insert(shot);
  to_end_.insert(shot);
}

bool Planner::expand_one() {
  if (to_expand_.empty()) return false;
  const ShotId shot = *to_expand_.begin();
  to_expand_.erase(to_expand_.begin());
  try {
    store_.guarded([&] { expand(shot, /*strict=*/false); });
  } catch (const DatabaseError&) {
    throw;
  } catch (const Error& e) {  // the shot cannot be planned further; what is planned goes on
    store_.set_shot_state(shot, store_.shot(shot)->state, e.what());
    effects_.changed.insert(shot);
    to_end_.insert(shot);
  }
  return true;
}

void Planner::apply(ShotId shot, const Plan& plan, const ShotPlan& wanted) {
  const ShotRow row = *store_.shot(shot);
  check(row.generation == plan.generation, "a plan is read anew for each generation");
  Rows rows;
  for (JobOutline& job : store_.outlines_of(shot)) rows.emplace(job.name, std::move(job));
  std::unordered_set<std::string> touched;
  for (const PlannedUnit& planned : wanted.units) apply_unit(row, planned, rows, touched);
  drop_unwanted(row, wanted, rows);
}

void Planner::apply_unit(const ShotRow& shot, const PlannedUnit& planned, Rows& rows,
                         std::unordered_set<std::string>& touched) {
  const WorkUnit& unit = planned.unit;
  const auto found = rows.find(unit.name);
  const JobOutline* old = found == rows.end() ? nullptr : &found->second;
  std::vector<JobId> needs;
  const JobOutline *bad = nullptr, *unmet = nullptr;
  int num_unmet = 0;
  bool need_touched = false;
  for (const auto& name : std::set<std::string>(unit.needs.begin(), unit.needs.end())) {
    const JobOutline& need = rows.at(name);
    needs.push_back(need.id);
    if (is_bad(need.state)) bad = &need;
    if (!is_good(need.state)) unmet = &need, ++num_unmet;
    need_touched |= touched.contains(name);
  }
  const std::string hash = plan_hash(planned);
  const bool same = old != nullptr && old->plan_hash == hash;
  const bool stuck = old != nullptr && old->state == JobState::Blocked && (bad != nullptr || num_unmet == 0);
  if (same && old->generation == shot.generation && old->num_unmet == num_unmet && !need_touched && !stuck) return;

  const JobState before = old != nullptr ? old->state : JobState::Blocked;
  const std::string content_before = old != nullptr ? old->content : "";
  const JobRow job = write_unit(shot, planned, hash, old);
  if (same)
    store_.set_num_unmet(job.id, num_unmet);
  else if (old != nullptr || !needs.empty())
    store_.set_needs(job.id, needs, num_unmet);
  if (num_unmet > 0) block(job.id, job.state, fmt::format("waits for {}", unmet->name));
  if (bad != nullptr)
    move(job.id, JobState::Aborted, fmt::format("needs {}, which is {}", bad->name, to_string(bad->state)));
  if (num_unmet == 0) settle(job);
  JobOutline now = store_.outline(job.id);
  if (now.state != before || now.content != content_before) touched.insert(unit.name);
  rows.insert_or_assign(unit.name, std::move(now));
}

JobRow Planner::write_unit(const ShotRow& shot, const PlannedUnit& planned, const std::string& hash,
                           const JobOutline* old) {
  if (old != nullptr && old->plan_hash == hash) {  // keeps resources that were raised after a failure
    if (old->generation != shot.generation) store_.set_generation(old->id, shot.generation);
    return *store_.job(old->id);
  }
  JobRow row = old != nullptr ? *store_.job(old->id) : JobRow{};
  row.generation = shot.generation;
  row.shot = shot.id;
  row.name = planned.unit.name;
  row.kind = planned.kind;
  row.stage = planned.stage;
  row.version = planned.version;
  row.plan_hash = hash;
  row.params = planned.unit.params.dump();
  row.unit = planned.unit.unit.dump();
  row.sources = sources_text(planned.unit);
  row.links = links_text(planned.unit);
  row.cores = planned.unit.need.cores;
  row.ram_mb = planned.unit.need.ram_mb;
  row.timeout_s = planned.unit.need.timeout_s;
  row.pool = planned.placement.pool;
  row.tags = planned.placement.tags;
  if (old != nullptr) {
    store_.update_plan(row);
  } else {
    row.priority = store_.stage_setting(shot.id, row.kind).priority.value_or(shot.priority);
    row.id = store_.insert_job(row);
  }
  return row;
}

/// Kinds whose split failed are left as they are: nothing is known of what they want.
void Planner::drop_unwanted(const ShotRow& shot, const ShotPlan& wanted, const Rows& rows) {
  std::unordered_set<std::string_view> names;
  for (const auto& planned : wanted.units) names.insert(planned.unit.name);
  for (const auto& [name, job] : rows) {
    if (names.contains(name) || job.kind == SelfTestJob::spec().name) continue;
    const bool planned_now = job.generation == shot.generation;
    if (planned_now && wanted.errors.contains(job.kind)) continue;
    if (planned_now) store_.set_generation(job.id, 0);
    if (is_finished(job.state)) continue;
    revoke(job.id);
    move(job.id, JobState::Aborted, "not in the plan any more");
  }
}

}  // namespace vantage
