/// Dispatcher: what people ask of a worker.
#include <fmt/format.h>

#include "scheduler/dispatch/dispatcher.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

using Verb = Command::Verb;

std::string hours_text(const WorkingHours& hours, const std::string& text, std::int64_t wall_ms) {
  if (hours.always()) return "works at all hours";
  const auto next_ms = hours.next_opening_ms(wall_ms);
  return fmt::format("works {}, {}", text, next_ms ? "from " + weekday_and_time(*next_ms) + " on" : "also now");
}

}  // namespace

/// What the command does, or with dry_run would do, in words.
std::string Dispatcher::effect_of(const Command& command, const LiveWorker& worker) const {
  const auto num_failures = worker.standing.failures().size();
  switch (command.verb) {
    case Verb::Drain:
      return fmt::format("finishes the {} jobs that it has and takes nothing new", worker.held.size());
    case Verb::Undrain:
      return "takes work again";
    case Verb::Hours:
      return hours_text(WorkingHours::parse(command.hours), command.hours, store_.clock().wall_ms());
    case Verb::Forgive:
      return fmt::format("is trusted again, {} failures are forgotten{}", num_failures,
                         worker.set_aside.empty() ? "" : "; it was set aside: " + worker.set_aside);
    default:
      return "checks itself now; 'vantage workers' and 'vantage audit' tell how it went";
  }
}

CommandResult Dispatcher::on_worker_command(const Command& command) {
  if (!store_.worker_state(command.worker))
    throw Error(ErrorKind::BadInput, fmt::format("{}: there is no such worker", command.worker));
  LiveWorker& worker = workers_[command.worker];
  CommandResult result{.num_changed = 1,
                       .text = fmt::format("{} {}", command.worker, effect_of(command, worker)),
                       .affected = {command.worker}};
  if (command.dry_run) return result;
  switch (command.verb) {
    case Verb::Drain:
    case Verb::Undrain:
      worker.drained = command.verb == Verb::Drain;
      worker.changed = true;
      store_.set_meta("drain/" + command.worker, worker.drained ? "1" : "");
      break;
    case Verb::Hours:
      worker.hours = WorkingHours::parse(command.hours);
      worker.outside_hours = !worker.hours.are_open(store_.clock().wall_ms());
      store_.set_worker_hours(command.worker, command.hours);
      break;
    case Verb::Forgive:
      forgive(worker);
      break;
    default:
      start_selftest(worker, store_.clock().monotonic_ms());
  }
  may_claim_ = true;
  show_state(worker);
  return result;
}

}  // namespace vantage
