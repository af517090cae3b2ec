/// Dispatcher: what people ask of a worker.
#include <fmt/format.h>

#include "scheduler/dispatch/dispatcher.h"
#include "schema/base/error.h"

namespace vantage {

CommandResult Dispatcher::on_worker_command(const Command& command) {
  if (!store_.worker_state(command.worker))
    throw Error(ErrorKind::BadInput, fmt::format("{}: there is no such worker", command.worker));
  const bool drain = command.verb == Command::Verb::Drain;
  CommandResult result{.num_changed = 1,
                       .text = fmt::format("{} {}", command.worker,
                                           drain ? "finishes what it runs and takes nothing new" : "takes work again")};
  if (command.dry_run) return result;
  LiveWorker& worker = workers_[command.worker];
  worker.drained = drain;
  worker.changed = true;
  store_.set_meta("drain/" + command.worker, drain ? "1" : "");
  if (!worker.lost && worker.seen_ms > 0) store_.set_worker_state(command.worker, drain ? "draining" : "active");
  return result;
}

}  // namespace vantage
