// vantage doctor: what may be wrong here, and what mends it.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "scheduler/cli/commands.h"
#include "scheduler/cli/parse.h"
#include "scheduler/farm/farm_config.h"
#include "scheduler/upkeep/doctor.h"
#include "schema/base/error.h"
#include "schema/base/json.h"

namespace vantage {
namespace {

DoctorRequest parse_options(const Arguments& arguments, bool& json) {
  CLI::App app{"Looks at this machine, and at a shot's store, a farm's folder, bus and scheduler when they are named.",
               "vantage doctor"};
  DoctorRequest request;
  app.add_option("shot", request.shot, "folder of a shot");
  app.add_option("--state", request.state_dir, "folder of a farm");
  app.add_option("--bus", request.bus, "LCM URL of a farm; left out: what STATE/farm.toml says");
  app.add_option("--server", request.server, "the scheduler, e.g. http://127.0.0.1:8080");
  app.add_flag("--json", json, "for programs");
  parse(app, arguments);
  return request;
}

/// What the farm's own file says, where the person did not.
std::string bus_in_file(const std::filesystem::path& state_dir) {
  try {
    return read_farm_config(state_dir).server.bus;
  } catch (const Error&) {
    return "";  // the check of farm.toml says what is wrong
  }
}

void print(const std::vector<Finding>& findings) {
  for (const Finding& f : findings) {
    fmt::print("{:<4}  {:<14}  {}\n", to_string(f.level), f.check, f.found);
    if (!f.mend.empty()) fmt::print("      {:<14}  → {}\n", "", f.mend);
  }
}

Json to_json(const std::vector<Finding>& findings) {
  Json out = Json::array();
  for (const Finding& f : findings)
    out.push_back({{"level", to_string(f.level)}, {"check", f.check}, {"found", f.found}, {"mend", f.mend}});
  return out;
}

}  // namespace

int doctor_command(const Arguments& arguments) {
  bool json = false;
  DoctorRequest request = parse_options(arguments, json);
  if (request.bus.empty() && !request.state_dir.empty()) request.bus = bus_in_file(request.state_dir);
  if (const char* token = std::getenv("VANTAGE_TOKEN")) request.token = token;
  request.version = VANTAGE_VERSION;
  request.worker_program =
      std::filesystem::path(std::filesystem::read_symlink("/proc/self/exe")).parent_path() / "vantage-worker";
  const auto findings = examine(request, this_machine());
  if (json)
    fmt::print("{}\n", to_json(findings).dump());
  else
    print(findings);
  const bool bad =
      std::any_of(findings.begin(), findings.end(), [](const Finding& f) { return f.level == Finding::Level::Fail; });
  return bad ? kExitFailed : kExitOk;
}

}  // namespace vantage
