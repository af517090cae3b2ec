#include "scheduler/cli/command_table.h"

#include <fmt/format.h>

#include <cstdio>

#include "scheduler/cli/commands.h"
#include "scheduler/cli/parse.h"
#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr const char* kVersion = VANTAGE_VERSION;

void print_help() {
  fmt::print("Vantage {} turns video of one scene from several cameras into new views of it.\n\n", kVersion);
  for (const auto& command : all_commands()) fmt::print("  vantage {:<10} {}\n", command.name, command.summary);
  fmt::print("\n'vantage COMMAND --help' says more. Exit codes: 0 ok, 1 failed, 2 misuse or bad input.\n");
}

/// First line only: an error is one line, whatever a library puts into its text.
void print_error(const std::string& message) {
  fmt::print(stderr, "vantage: {}\n", message.substr(0, message.find('\n')));
}

int dispatch(const Arguments& arguments) {
  if (arguments.empty() || arguments[0] == "help" || arguments[0] == "--help" || arguments[0] == "-h") {
    print_help();
    return arguments.empty() ? kExitMisuse : kExitOk;
  }
  if (arguments[0] == "--version") {
    fmt::print("vantage {}\n", kVersion);
    return kExitOk;
  }
  std::vector<std::string> names;
  for (const auto& command : all_commands()) {
    if (arguments[0] == command.name) return command.fn({arguments.begin() + 1, arguments.end()});
    names.emplace_back(command.name);
  }
  throw Error(ErrorKind::BadInput, fmt::format("unknown command '{}'{}; 'vantage help' lists them all", arguments[0],
                                               did_you_mean(arguments[0], names)));
}

}  // namespace

const std::vector<CliCommand>& all_commands() {
  static const std::vector<CliCommand> commands{
      {"init", "write SHOT/shot.toml from footage", init_command},
      {"check", "validate a shot and its footage, show the plan; change nothing", check_command},
      {"run", "run a shot on this machine; safe to interrupt and run again", run_shot_command},
      {"farm", "make a farm's folder, give out tokens", farm_command},
      {"scheduler", "serve a farm: scheduler, page and API", scheduler_command},
      {"submit", "give a shot to a scheduler", submit_command},
      {"status", "how far a shot is", status_command},
      {"jobs", "list a shot's jobs", jobs_command},
      {"logs", "print a job's log", logs_command},
      {"why", "explain a job: why it waits, runs again, failed or was skipped", why_command},
      {"workers", "list the machines that work; set their hours, forgive them, test them", workers_command},
      {"drain", "let a worker finish what it runs and take nothing new", drain_command},
      {"undrain", "let a drained worker take work again", undrain_command},
      {"pause", "start no more jobs of a shot or a stage", pause_command},
      {"resume", "go on with what was paused", resume_command},
      {"cancel", "give up a shot, a stage or a job", cancel_command},
      {"retry", "run failed jobs again", retry_command},
      {"rerun", "make finished results again", rerun_command},
      {"priority", "let a shot, a stage or a job go first", priority_command},
      {"audit", "who did what and when", audit_command},
      {"gc", "list or remove what no shot can reach any more", gc_command},
      {"verify", "compare a shot's results with their hashes; make some again", verify_command},
      {"backup", "copy a farm's database, settings and key", backup_command},
      {"restore", "bring a backup or a snapshot back", restore_command},
      {"archive", "pack a finished shot into one file, or unpack it", archive_command},
      {"doctor", "say what is wrong with this machine, farm or network", doctor_command},
      {"bench", "measure what a farm of this machine costs per job", bench_command},
  };
  return commands;
}

int run_command_line(const Arguments& arguments) {
  try {
    return dispatch(arguments);
  } catch (const HelpShown&) {
    return kExitOk;
  } catch (const Error& e) {
    print_error(e.what());
    return e.kind() == ErrorKind::BadInput ? kExitMisuse : kExitFailed;
  } catch (const std::exception& e) {
    print_error(e.what());
    return kExitFailed;
  }
}

}  // namespace vantage
