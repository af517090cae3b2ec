#pragma once
#include <string>
#include <vector>

namespace vantage {

using Arguments = std::vector<std::string>;

/// Exit codes of every command.
constexpr int kExitOk = 0, kExitFailed = 1, kExitMisuse = 2;

/// One command. fn gets what follows the name; it may throw Error: BadInput ends with kExitMisuse, all else with
/// kExitFailed.
struct CliCommand {
  const char* name;
  const char* summary;
  int (*fn)(const Arguments&);
};

/// The one list of commands, in the order of --help.
const std::vector<CliCommand>& all_commands();

/// Dispatches, prints errors as one line "vantage: …" to stderr, returns the exit code. The boundary for exceptions.
int run_command_line(const Arguments& arguments);

}  // namespace vantage
