/// Dispatcher: what people ask for.
#include <fmt/format.h>

#include "scheduler/dispatch/dispatcher.h"
#include "schema/base/error.h"

namespace vantage {

CommandResult Dispatcher::on_command(const Command& command) {
  stop_revoked();
  using enum Command::Verb;
  CommandResult result = command.verb == Drain || command.verb == Undrain ? on_worker_command(command)
                         : command.job                                    ? on_job_command(command)
                                                                          : on_shot_command(command);
  store_.add_event(command.shot, command.job, command.worker, "command", result.text);
  stop_revoked();
  return result;
}

CommandResult Dispatcher::on_shot_command(const Command& command) {
  const auto shot = command.shot ? store_.shot(*command.shot) : std::nullopt;
  if (!shot)
    throw Error(ErrorKind::BadInput,
                fmt::format("shot {}: there is no such shot", command.shot.value_or(ShotId{}).value));
  planner_.touch(shot->id);
  const bool open = shot->state == "running" || shot->state == "paused";
  switch (command.verb) {
    case Command::Verb::Pause:
      if (!open)
        throw Error(ErrorKind::BadInput, fmt::format("{}: is {}, there is nothing to pause", shot->name, shot->state));
      store_.set_shot_state(shot->id, "paused", shot->error);
      return {1, fmt::format("{} is paused: what runs is finished, nothing new starts", shot->name)};
    case Command::Verb::Resume:
      if (shot->state != "paused")
        throw Error(ErrorKind::BadInput, fmt::format("{}: is {}, not paused", shot->name, shot->state));
      store_.set_shot_state(shot->id, "running", shot->error);
      return {1, fmt::format("{} goes on", shot->name)};
    case Command::Verb::Cancel: {
      const int num = planner_.cancel(shot->id);
      return {num, fmt::format("{}: {} jobs canceled", shot->name, num)};
    }
    case Command::Verb::Retry: {
      const int num = planner_.retry(shot->id);
      return {num, fmt::format("{}: {} jobs are tried again", shot->name, num)};
    }
    default:
      break;
  }
  store_.set_shot_priority(shot->id, command.priority);
  return {1, fmt::format("{} has priority {}", shot->name, command.priority)};
}

CommandResult Dispatcher::on_job_command(const Command& command) {
  const auto job = store_.job(*command.job);
  if (!job) throw Error(ErrorKind::BadInput, fmt::format("job {}: there is no such job", command.job->value));
  planner_.touch(job->shot);
  switch (command.verb) {
    case Command::Verb::Pause:
      if (job->state != JobState::Ready && job->state != JobState::Blocked)
        throw Error(ErrorKind::BadInput,
                    fmt::format("{}: is {}; only waiting jobs can be paused", job->name, to_string(job->state)));
      store_.move(job->id, JobState::Paused, "paused by a person");
      return {1, fmt::format("{} is paused", job->name)};
    case Command::Verb::Resume:
      if (job->state != JobState::Paused)
        throw Error(ErrorKind::BadInput, fmt::format("{}: is {}, not paused", job->name, to_string(job->state)));
      planner_.recheck(*job);
      return {1, fmt::format("{} goes on", job->name)};
    case Command::Verb::Cancel: {
      const int num = planner_.cancel(*job);
      return {num, num > 0 ? fmt::format("{} is canceled", job->name)
                           : fmt::format("{} is {} already", job->name, to_string(job->state))};
    }
    case Command::Verb::Retry: {
      const int num = planner_.retry(*job);
      return {num, num > 0 ? fmt::format("{}: {} jobs are tried again", job->name, num)
                           : fmt::format("{} is {}: there is nothing to try again", job->name, to_string(job->state))};
    }
    default:
      break;
  }
  store_.set_job_priority(job->id, command.priority);
  return {1, fmt::format("{} has priority {}", job->name, command.priority)};
}

CommandResult Dispatcher::on_worker_command(const Command& command) {
  if (!store_.worker_state(command.worker))
    throw Error(ErrorKind::BadInput, fmt::format("{}: there is no such worker", command.worker));
  LiveWorker& worker = workers_[command.worker];
  worker.drained = command.verb == Command::Verb::Drain;
  worker.changed = true;
  store_.set_meta("drain/" + command.worker, worker.drained ? "1" : "");
  if (!worker.lost && worker.seen_ms > 0)
    store_.set_worker_state(command.worker, worker.drained ? "draining" : "active");
  return {1, fmt::format("{} {}", command.worker,
                         worker.drained ? "finishes what it runs and takes nothing new" : "takes work again")};
}

}  // namespace vantage
