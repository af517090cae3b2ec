// vantage gc: what may go from the stores of a shot or of a whole farm.
#include <fmt/format.h>

#include <set>

#include "scheduler/cli/commands.h"
#include "scheduler/cli/parse.h"
#include "scheduler/farm/farm_config.h"
#include "scheduler/upkeep/collect.h"
#include "schema/base/clock.h"
#include "schema/base/error.h"
#include "schema/base/json.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kDayMs = 86'400'000;
constexpr int kMaxLines = 40;

struct GcOptions {
  fs::path shot;
  std::vector<fs::path> state_dirs;
  bool remove = false, json = false, all = false;
  int keep_days = 7;
};

GcOptions parse_options(const Arguments& arguments) {
  CLI::App app{
      "Lists what no shot can reach any more: results of old plans, left-overs of dead processes, old logs. Removes "
      "only with --delete. Farms that use the store may go on meanwhile.",
      "vantage gc"};
  GcOptions options;
  app.add_option("shot", options.shot, "folder of one shot; left out: every shot of the farm");
  app.add_option("--state", options.state_dirs, "folder of a farm; may be given several times");
  app.add_flag("--delete", options.remove, "remove what is listed");
  app.add_option("--keep-days", options.keep_days, "what is younger stays")
      ->check(CLI::Range(0, 3650))
      ->capture_default_str();
  app.add_flag("--all", options.all, "list every item");
  app.add_flag("--json", options.json, "for programs");
  parse(app, arguments);
  if (options.shot.empty() && options.state_dirs.empty())
    throw Error(ErrorKind::BadInput, "vantage gc: name a shot, or a farm with --state");
  return options;
}

/// The stores to look at.
std::set<fs::path> stores_of(const GcOptions& options) {
  std::set<fs::path> stores;
  if (!options.shot.empty()) {
    stores.insert(store_of(options.shot));
  } else {
    for (const fs::path& state_dir : options.state_dirs) {
      Sqlite db = open_farm_to_read(state_dir);
      for (Query q = db.query("SELECT folder FROM shot"); q.step();) stores.insert(store_of(q.text(0)));
    }
  }
  if (!options.shot.empty() && stores.contains(fs::path()))
    throw Error(ErrorKind::BadInput, fmt::format("{}: has no store yet: nothing has run", options.shot.string()));
  stores.erase(fs::path());  // shots whose folder is not there any more
  return stores;
}

std::vector<fs::path> farms_that_use(const fs::path& store, const GcOptions& options) {
  std::vector<fs::path> named = options.state_dirs;
  const fs::path own = options.shot / ".vantage" / "farm";  // of `vantage run`
  if (!options.shot.empty() && fs::exists(own / "farm.sqlite")) named.push_back(own);
  auto farms = farms_of_store(store, named);
  if (farms.empty())
    throw Error(ErrorKind::BadInput, fmt::format("{}: no farm is known that uses it; name it with --state, as without "
                                                 "its plan everything would look unused",
                                                 store.string()));
  return farms;
}

void print_list(const std::vector<Garbage>& list, bool all) {
  std::size_t num = 0;
  for (const Garbage& item : list) {
    if (!all && num == kMaxLines) {
      fmt::print("  … and {} more (--all lists them)\n", list.size() - num);
      break;
    }
    fmt::print("  {:<10} {:>9.1f} MB  {}  ({})\n", to_string(item.what), static_cast<double>(item.num_bytes) / 1e6,
               item.path.string(), item.why);
    ++num;
  }
}

Json to_json(const std::vector<Garbage>& list) {
  Json out = Json::array();
  for (const Garbage& item : list)
    out.push_back({{"what", to_string(item.what)},
                   {"path", item.path.string()},
                   {"num_bytes", item.num_bytes},
                   {"why", item.why}});
  return out;
}

std::uintmax_t total_bytes(const std::vector<Garbage>& list) {
  std::uintmax_t sum = 0;
  for (const Garbage& item : list) sum += item.num_bytes;
  return sum;
}

}  // namespace

int gc_command(const Arguments& arguments) {
  const GcOptions options = parse_options(arguments);
  std::vector<Garbage> found, put_back;
  for (const fs::path& store : stores_of(options)) {
    const auto farms = farms_that_use(store, options);
    const FarmConfig::Logs logs = read_farm_config(farms.front()).logs;
    const GarbageAges ages{.now_ms = system_clock().wall_ms(),
                           .keep_ms = options.keep_days * kDayMs,
                           .keep_logs_ms = std::min(options.keep_days, logs.keep_days) * kDayMs,
                           .max_log_bytes = static_cast<std::uintmax_t>(logs.attempts_max_mb) * 1'000'000};
    Collected done;
    if (options.remove)
      done = collect_garbage({.store = store, .state_dirs = farms, .ages = ages, .between = nullptr});
    else
      done.removed = find_garbage(store, reach_of(store, farms), ages);
    found.insert(found.end(), done.removed.begin(), done.removed.end());
    put_back.insert(put_back.end(), done.put_back.begin(), done.put_back.end());
  }
  if (options.json) {
    fmt::print("{}\n", Json{{"deleted", options.remove},
                            {"num_bytes", total_bytes(found)},
                            {"items", to_json(found)},
                            {"put_back", to_json(put_back)}}
                           .dump());
    return kExitOk;
  }
  print_list(found, options.all);
  const double mb = static_cast<double>(total_bytes(found)) / 1e6;
  if (options.remove)
    fmt::print("Removed {} items, {:.1f} MB.{}\n", found.size(), mb,
               put_back.empty() ? "" : fmt::format(" {} stay: a scheduler has just used them.", put_back.size()));
  else
    fmt::print("{} items, {:.1f} MB could go. Nothing was changed; --delete removes them.\n", found.size(), mb);
  return kExitOk;
}

}  // namespace vantage
