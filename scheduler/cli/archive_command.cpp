// vantage archive: a finished shot in one file, and back.
#include <fmt/format.h>

#include "scheduler/cli/commands.h"
#include "scheduler/cli/parse.h"
#include "scheduler/upkeep/archive.h"
#include "schema/base/error.h"
#include "schema/base/json.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

struct ArchiveOptions {
  fs::path from, to, state_dir;
  bool restore = false, remove_store = false, json = false;
};

/// A folder gets a file named after the shot.
fs::path file_for(const fs::path& shot, const fs::path& to) {
  return fs::is_directory(to) ? to / (shot.filename().string() + ".tar.zst") : to;
}

ArchiveOptions parse_options(const Arguments& arguments) {
  CLI::App app{
      "Packs a finished shot into one file: shot.toml, out/, results with their hashes, the job table. The file is "
      "unpacked and checked before it gets its name. Footage is not in it.",
      "vantage archive"};
  ArchiveOptions options;
  app.add_option("from", options.from, "folder of the shot; with --restore the packed file")->required();
  app.add_option("--to", options.to, "file or folder; with --restore the shot's new folder")->required();
  app.add_option("--state", options.state_dir, "folder of the farm; left out: that of 'vantage run'");
  app.add_flag("--restore", options.restore, "unpack instead");
  app.add_flag("--remove-store", options.remove_store, "then remove the shot's store, specs, logs and links in out/");
  app.add_flag("--json", options.json, "for programs");
  parse(app, arguments);
  options.from = fs::absolute(options.from).lexically_normal();
  if (options.from.filename().empty()) options.from = options.from.parent_path();
  if (options.state_dir.empty()) options.state_dir = options.from / ".vantage" / "farm";
  if (options.restore && options.remove_store)
    throw Error(ErrorKind::BadInput, "vantage archive: --remove-store goes with packing, not with --restore");
  if (!options.restore) options.to = file_for(options.from, options.to);
  return options;
}

}  // namespace

int archive_command(const Arguments& arguments) {
  const ArchiveOptions options = parse_options(arguments);
  const ArchiveFacts facts =
      options.restore ? unpack_shot(options.from, options.to) : pack_shot(options.from, options.state_dir, options.to);
  if (options.remove_store) remove_archived(options.from);
  if (options.json) {
    fmt::print("{}\n", Json{{"shot", facts.shot},
                            {"file", (options.restore ? options.from : options.to).string()},
                            {"num_jobs", facts.num_jobs},
                            {"num_artifacts", facts.num_artifacts},
                            {"num_bytes", facts.num_bytes}}
                           .dump());
    return kExitOk;
  }
  fmt::print("{}: {} jobs, {} results, every hash checked; {:.1f} MB packed.\n", options.to.string(), facts.num_jobs,
             facts.num_artifacts, static_cast<double>(facts.num_bytes) / 1e6);
  if (options.restore)
    fmt::print("Put the footage back where shot.toml names it, then 'vantage run {}' finds all results.\n",
               options.to.string());
  if (options.remove_store) fmt::print("The store of {} is removed.\n", options.from.string());
  return kExitOk;
}

}  // namespace vantage
