#include "scheduler/cli/parse.h"

#include <fmt/format.h>

#include "schema/base/error.h"

namespace vantage {

void parse(CLI::App& app, const Arguments& arguments) {
  try {
    app.parse(Arguments(arguments.rbegin(), arguments.rend()));  // CLI11 takes them from the back
  } catch (const CLI::CallForHelp&) {
    fmt::print("{}", app.help());
    throw HelpShown{};
  } catch (const CLI::ParseError& e) {
    throw Error(ErrorKind::BadInput, fmt::format("{}: {}; see '{} --help'", app.get_name(), e.what(), app.get_name()));
  }
}

}  // namespace vantage
