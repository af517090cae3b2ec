// vantage backup, vantage restore.
#include <fmt/format.h>

#include "scheduler/cli/commands.h"
#include "scheduler/cli/parse.h"
#include "scheduler/upkeep/backup.h"
#include "schema/base/clock.h"
#include "schema/base/json.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

struct Places {
  fs::path state_dir, other;
  bool json = false;
};

void declare(CLI::App& app, Places& places, const char* meaning) {
  app.add_option("place", places.other, meaning)->required();
  app.add_option("--state", places.state_dir, "folder of the farm")->required();
  app.add_flag("--json", places.json, "for programs");
}

Json to_json(const BackupFacts& facts) {
  return {{"farm_id", facts.farm_id},
          {"version", facts.version},
          {"num_shots", facts.num_shots},
          {"num_jobs", facts.num_jobs},
          {"num_done", facts.num_done}};
}

std::string sentence(const BackupFacts& facts) {
  return fmt::format("{} shots, {} jobs, {} of them done", facts.num_shots, facts.num_jobs, facts.num_done);
}

}  // namespace

int backup_command(const Arguments& arguments) {
  CLI::App app{"Copies a farm's database, settings and key to a new folder, checked. The farm may be running.",
               "vantage backup"};
  Places places;
  declare(app, places, "folder to make; it will hold the farm's key");
  parse(app, arguments);
  const BackupFacts facts = back_up(places.state_dir, places.other);
  if (places.json)
    fmt::print("{}\n", to_json(facts).dump());
  else
    fmt::print("{}: {}. Results lie in the shots' stores and are not in it.\n", places.other.string(), sentence(facts));
  return kExitOk;
}

int restore_command(const Arguments& arguments) {
  CLI::App app{"Puts a backup or a snapshot in the place of a farm's database; what it replaces is kept beside it.",
               "vantage restore"};
  Places places;
  declare(app, places, "folder made by 'vantage backup', or a file of STATE/snapshots");
  parse(app, arguments);
  const Restored done = restore(places.state_dir, places.other, system_clock().wall_ms());
  if (places.json) {
    Json out = to_json(done.facts);
    out["replaced"] = done.replaced.string();
    out["settings_kept"] = done.settings_kept;
    out["settings_restored"] = done.settings_restored;
    fmt::print("{}\n", out.dump());
    return kExitOk;
  }
  fmt::print("{} has the state of the copy: {}.\n", places.state_dir.string(), sentence(done.facts));
  if (!done.replaced.empty()) fmt::print("The database from before is kept: {}\n", done.replaced.string());
  for (const auto& name : done.settings_kept) fmt::print("{} is as it was; the copy's was not used.\n", name);
  fmt::print(
      "Results that were finished since the copy are not lost: they lie in the stores and are found by their keys when "
      "their jobs come up.\nShots submitted since then are unknown now: submit them again.\nStart it: vantage "
      "scheduler "
      "--state '{}'\n",
      places.state_dir.string());
  return kExitOk;
}

}  // namespace vantage
