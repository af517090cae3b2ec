#pragma once
#include <CLI/CLI.hpp>

#include "scheduler/cli/command_table.h"

namespace vantage {

/// Thrown after --help was printed: nothing more to do.
struct HelpShown {};

/// Throws Error(BadInput) with one line for misuse, HelpShown for --help.
void parse(CLI::App& app, const Arguments& arguments);

}  // namespace vantage
