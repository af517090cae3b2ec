#include "scheduler/upkeep/reach.h"

#include <fmt/format.h>

#include "scheduler/farm/store_users.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

bool has_farm(const fs::path& state_dir) {
  std::error_code unreadable;  // counts as no farm; the caller says so
  return fs::exists(state_dir / "farm.sqlite", unreadable);
}

void add_plan(Sqlite& db, std::int64_t shot_id, const fs::path& folder, Reach& reach) {
  for (Query q = db.query("SELECT j.kind, j.key, j.name FROM job j JOIN shot s ON s.id = j.shot_id "
                          "WHERE j.shot_id = ? AND j.generation = s.generation",
                          shot_id);
       q.step();) {
    if (!q.text(1).empty()) reach.artifacts.insert(q.text(0) + "/" + q.text(1));
    reach.spec_names.insert((folder / ".vantage" / "specs" / (q.text(2) + ".json")).string());
  }
}

void add_running(Sqlite& db, Reach& reach) {
  for (Query q = db.query("SELECT j.kind, a.key, a.log_path, j.name, s.folder FROM attempt a "
                          "JOIN job j ON j.id = a.job_id JOIN shot s ON s.id = j.shot_id WHERE a.state <> 'ended'");
       q.step();) {
    reach.artifacts.insert(q.text(0) + "/" + q.text(1));
    reach.open_logs.insert(q.text(2));
    reach.spec_names.insert((fs::path(q.text(4)) / ".vantage" / "specs" / (q.text(3) + ".json")).string());
  }
}

/// Links may be of a plan that nobody knows any more, but a person looks at them.
void add_links(const fs::path& out, const fs::path& store, Reach& reach) {
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(out, error)) {
    if (!entry.is_symlink()) continue;
    const fs::path inside = fs::weakly_canonical(entry.path(), error).lexically_relative(store);
    if (error || inside.empty() || *inside.begin() == "..") continue;
    auto part = inside.begin();
    const fs::path kind = *part++;
    if (part != inside.end()) reach.artifacts.insert(kind.string() + "/" + part->string());
  }
}

}  // namespace

Reach reach_of_running(Sqlite& db) {
  Reach reach;
  add_running(db, reach);
  return reach;
}

fs::path store_of(const fs::path& shot_folder) {
  std::error_code none;
  return fs::canonical(shot_folder / ".vantage" / "store", none);
}

std::vector<fs::path> farms_of_store(const fs::path& store, const std::vector<fs::path>& named) {
  std::set<fs::path> farms;
  for (const fs::path& state_dir : named) {
    if (!has_farm(state_dir)) throw Error(ErrorKind::BadInput, fmt::format("{}: no farm here", state_dir.string()));
    farms.insert(fs::canonical(state_dir));
  }
  for (const StoreUser& user : store_users(store)) {
    if (!has_farm(user.state_dir))
      throw Error(ErrorKind::BadInput,
                  fmt::format("{}: is used by farm {} of host {}, whose folder {} cannot be read here; run this there, "
                              "or, when that farm is gone for good, remove {}",
                              store.string(), user.farm_id, user.host, user.state_dir.string(),
                              (store / ".farms" / (user.farm_id + ".json")).string()));
    farms.insert(fs::canonical(user.state_dir));
  }
  return {farms.begin(), farms.end()};
}

Reach reach_of(const fs::path& store, const std::vector<fs::path>& state_dirs) {
  Reach reach;
  for (const fs::path& state_dir : state_dirs) {
    Sqlite db = open_farm_to_read(state_dir);
    db.run("BEGIN");  // one state of the database for all that follows
    for (Query q = db.query("SELECT id, folder FROM shot"); q.step();) {
      const fs::path folder = q.text(1);
      if (store_of(folder) != store) continue;
      reach.shots.insert(folder);
      add_plan(db, q.integer(0), folder, reach);
    }
    add_running(db, reach);
  }
  for (const fs::path& shot : reach.shots) add_links(shot / "out", store, reach);
  return reach;
}

}  // namespace vantage
