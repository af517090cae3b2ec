/// Dispatcher: what people ask for. Each verb first chooses the jobs that it is about, then, unless it is a dry run,
/// does it.
#include <fmt/format.h>

#include <algorithm>

#include "scheduler/dispatch/dispatcher.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

using Verb = Command::Verb;

bool is_for_worker(Verb verb) { return verb >= Verb::Drain; }

/// "1 job", "226 jobs"
std::string jobs_text(std::size_t num) { return fmt::format("{} job{}", num, num == 1 ? "" : "s"); }

}  // namespace

/// The part of a shot that a command is about.
struct Dispatcher::Target {
  ShotRow shot;
  std::string stage;          ///< empty: all, or one job
  std::optional<JobRow> job;  ///< empty: the stage or the shot
  std::string name() const { return job ? job->name : stage.empty() ? shot.name : shot.name + " " + stage; }
  bool is_shot() const { return !job && stage.empty(); }
  bool is_open() const { return shot.state == "running" || shot.state == "paused"; }
};

CommandResult Dispatcher::on_command(const Command& command) {
  stop_revoked();
  may_claim_ = true;
  const ActingAs acting(store_, command.who);
  CommandResult result = is_for_worker(command.verb) ? on_worker_command(command) : on_job_command(command);
  if (!command.dry_run) store_.add_event(command.shot, command.job, command.worker, "command", result.text);
  stop_revoked();
  return result;
}

Dispatcher::Target Dispatcher::target_of(const Command& command) {
  Target target;
  ShotId shot = command.shot.value_or(ShotId{});
  if (command.job) {
    target.job = store_.job(*command.job);
    if (!target.job) throw Error(ErrorKind::BadInput, fmt::format("job {}: there is no such job", command.job->value));
    shot = target.job->shot;
  }
  const auto row = store_.shot(shot);
  if (!row) throw Error(ErrorKind::BadInput, fmt::format("shot {}: there is no such shot", shot.value));
  if (!command.stage.empty()) planner_.check_kind(command.stage);
  target.shot = *row;
  target.stage = command.job ? "" : command.stage;
  return target;
}

std::vector<JobId> Dispatcher::jobs_of(const Target& target, std::initializer_list<JobState> states) {
  if (!target.job) return store_.planned_in_states(target.shot.id, states, target.stage);
  if (std::find(states.begin(), states.end(), target.job->state) == states.end()) return {};
  return {target.job->id};
}

CommandResult Dispatcher::result_of(const std::vector<JobId>& jobs, std::string text) {
  CommandResult result{.num_changed = static_cast<int>(jobs.size()), .text = std::move(text)};
  for (std::size_t i = 0; i < std::min(jobs.size(), CommandResult::kMaxAffected); ++i)
    result.affected.push_back(store_.job(jobs[i])->name);
  return result;
}

CommandResult Dispatcher::on_job_command(const Command& command) {
  const Target target = target_of(command);
  if (!command.dry_run) planner_.touch(target.shot.id);
  switch (command.verb) {
    case Verb::Pause:
      return pause(target, command.dry_run);
    case Verb::Resume:
      return resume(target, command.dry_run);
    case Verb::Cancel:
      return cancel(target, command.dry_run);
    case Verb::Retry:
      return retry(target, command.dry_run);
    case Verb::Rerun:
      return rerun(target, command.dry_run);
    default:
      return set_priority(target, command.priority, command.dry_run);
  }
}

CommandResult Dispatcher::pause(const Target& target, bool dry_run) {
  using enum JobState;
  if (target.job && target.job->state != Ready && target.job->state != Blocked)
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: is {}; only waiting jobs can be paused", target.name(), to_string(target.job->state)));
  if (!target.is_open())
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: is {}, there is nothing to pause", target.shot.name, target.shot.state));
  const auto jobs = target.job ? std::vector{target.job->id} : jobs_of(target, {Ready});
  if (dry_run)
    return result_of(jobs, fmt::format("would pause {}: {} ready now, none of them would start", target.name(),
                                       jobs_text(jobs.size())));
  if (target.is_shot())
    store_.set_shot_state(target.shot.id, "paused", target.shot.error);
  else if (target.job)
    store_.move(target.job->id, Paused, "paused by a person");
  else
    planner_.pause_stage(target.shot.id, target.stage, jobs);
  if (target.job) return result_of(jobs, fmt::format("{} is paused", target.name()));
  return result_of(jobs, fmt::format("{} is paused: what runs is finished, nothing new starts", target.name()));
}

CommandResult Dispatcher::resume(const Target& target, bool dry_run) {
  using enum JobState;
  const bool stage_paused =
      !target.is_shot() && store_.stage_setting(target.shot.id, target.job ? target.job->kind : target.stage).paused;
  const bool paused = target.job         ? target.job->state == Paused
                      : target.is_shot() ? target.shot.state == "paused"
                                         : stage_paused;
  if (!paused)
    throw Error(ErrorKind::BadInput, fmt::format("{}: is {}, not paused", target.name(),
                                                 target.job         ? to_string(target.job->state)
                                                 : target.is_shot() ? std::string_view(target.shot.state)
                                                                    : "at work"));
  if (target.job && stage_paused)
    throw Error(ErrorKind::BadInput, fmt::format("{0}: the whole stage {1} is paused; 'vantage resume {2} --stage {1}' "
                                                 "lets it go on",
                                                 target.name(), target.job->kind, target.shot.folder.string()));
  const auto jobs = jobs_of(target, {target.is_shot() ? Ready : Paused});
  if (dry_run) return result_of(jobs, fmt::format("{} would go on: {}", target.name(), jobs_text(jobs.size())));
  CommandResult result = result_of(jobs, fmt::format("{} goes on", target.name()));
  if (target.is_shot())
    store_.set_shot_state(target.shot.id, "running", target.shot.error);
  else if (target.job)
    planner_.recheck(*target.job);
  else
    planner_.resume_stage(target.shot.id, target.stage, jobs);
  return result;
}

CommandResult Dispatcher::cancel(const Target& target, bool dry_run) {
  using enum JobState;
  const auto jobs = jobs_of(target, {Blocked, Ready, Leased, Running, Reconnect, Paused});
  std::vector<JobId> dependents;
  if (!target.is_shot())
    for (const JobId id : planner_.all_dependents(jobs))
      if (!is_finished(store_.job(id)->state)) dependents.push_back(id);
  std::string what = jobs_text(jobs.size());
  if (!dependents.empty()) what += fmt::format(", and {} that need them", jobs_text(dependents.size()));
  if (target.job && jobs.empty())
    return {0, fmt::format("{} is {} already", target.name(), to_string(target.job->state)), {}};
  std::vector<JobId> all = jobs;
  all.insert(all.end(), dependents.begin(), dependents.end());
  CommandResult result = result_of(all, dry_run ? fmt::format("would cancel {}: {}", target.name(), what)
                                                : fmt::format("{} is canceled: {}", target.name(), what));
  if (dry_run) return result;
  if (target.is_shot())
    planner_.cancel(target.shot.id);
  else
    planner_.cancel(jobs);
  return result;
}

CommandResult Dispatcher::retry(const Target& target, bool dry_run) {
  using enum JobState;
  auto jobs = jobs_of(target, {Failed, Quarantined, Canceled, Aborted});
  if (!target.is_shot()) jobs = planner_.to_retry(jobs);
  const auto num_aborted = static_cast<std::size_t>(
      std::count_if(jobs.begin(), jobs.end(), [&](JobId id) { return store_.job(id)->state == Aborted; }));
  if (jobs.empty())
    return {0,
            target.job
                ? fmt::format("{} is {}: there is nothing to try again", target.name(), to_string(target.job->state))
                : fmt::format("{}: nothing has failed, there is nothing to try again", target.name()),
            {}};
  const std::string what = fmt::format("{} failed + {} dependents", jobs.size() - num_aborted, num_aborted);
  CommandResult result = result_of(
      jobs, dry_run ? fmt::format("{}: would run again: {}", target.name(), what)
                    : fmt::format("{}: {} are tried again ({})", target.name(), jobs_text(jobs.size()), what));
  if (!dry_run) planner_.retry(target.shot.id, jobs);
  return result;
}

CommandResult Dispatcher::rerun(const Target& target, bool dry_run) {
  if (target.is_shot())
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: name the job or the stage whose results shall be made again", target.name()));
  if (target.job && target.job->generation != target.shot.generation)
    throw Error(ErrorKind::BadInput, fmt::format("{}: is not in the plan any more", target.name()));
  const auto jobs = jobs_of(target, {JobState::Done, JobState::Skipped});
  if (jobs.empty())
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: {}; only finished results can be made again ('vantage retry' is for failed jobs)",
                            target.name(), target.job ? to_string(target.job->state) : "nothing of it is finished"));
  const auto dependents = planner_.all_dependents(jobs);
  std::vector<JobId> all = jobs;
  all.insert(all.end(), dependents.begin(), dependents.end());
  const std::string what = fmt::format("{}, then those of {} dependents whose inputs come out different",
                                       jobs_text(jobs.size()), dependents.size());
  CommandResult result =
      result_of(all, fmt::format("{}: {}: {}", target.name(), dry_run ? "would be made again" : "is made again", what));
  if (!dry_run) planner_.rerun(target.shot.id, jobs);
  return result;
}

CommandResult Dispatcher::set_priority(const Target& target, int priority, bool dry_run) {
  using enum JobState;
  const auto jobs =
      target.job ? std::vector{target.job->id} : jobs_of(target, {Blocked, Ready, Leased, Running, Reconnect, Paused});
  CommandResult result = result_of(jobs, fmt::format("{} {} priority {}: {}", target.name(),
                                                     dry_run ? "would have" : "has", priority, jobs_text(jobs.size())));
  if (dry_run) return result;
  if (target.is_shot()) {
    store_.set_shot_priority(target.shot.id, priority);
    return result;
  }
  if (!target.job) {
    Store::StageSetting setting = store_.stage_setting(target.shot.id, target.stage);
    setting.priority = priority;
    store_.set_stage_setting(target.shot.id, target.stage, setting);
  }
  for (const JobId id : jobs) store_.set_job_priority(id, priority);
  return result;
}

}  // namespace vantage
