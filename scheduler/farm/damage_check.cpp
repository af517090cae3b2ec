#include "scheduler/farm/damage_check.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <vector>

#include "scheduler/store/snapshot_files.h"
#include "scheduler/store/sqlite.h"

namespace vantage {

DamageCheck::DamageCheck(std::filesystem::path state_dir)
    : state_dir_(std::move(state_dir)), thread_([this](const std::stop_token& stop) { look(stop); }) {}

DamageCheck::~DamageCheck() = default;

std::string DamageCheck::verdict() const {
  const std::lock_guard lock(mutex_);
  return verdict_;
}

/// The check of one table is one statement and cannot be broken off: table by table, so that a stop waits for one only.
void DamageCheck::look(const std::stop_token& stop) {
  try {
    Sqlite db = open_farm_to_read(state_dir_);
    std::vector<std::string> tables;
    for (Query q = db.query("SELECT name FROM sqlite_schema WHERE type = 'table'"); q.step();)
      tables.push_back(q.text(0));
    for (const std::string& table : tables) {
      if (stop.stop_requested()) return;
      const std::string found = db.text_or("", fmt::format("PRAGMA quick_check('{}')", table));
      if (found == "ok") continue;
      const std::lock_guard lock(mutex_);
      verdict_ = fmt::format(
          "{}: the database is damaged: {}; stop the farm and bring back its newest snapshot "
          "(`vantage restore`)",
          db.file().string(), found);
      spdlog::error("scheduler: {}", verdict_);
      return;
    }
  } catch (const Error& e) {  // it says nothing about damage; the farm's own connection will meet the same
    spdlog::warn("scheduler: the database could not be looked through: {}", e.what());
  }
}

}  // namespace vantage
