#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "scheduler/store/sqlite.h"

namespace vantage {

/// One step of the schema: version n brings a database of version n - 1 to n.
struct Migration {
  int version;
  std::string_view sql;
};

/// schema/sql/NNNN_*.sql, built into the program, in order.
const std::vector<Migration>& all_migrations();

/// Brings the database to the last version, each step in one transaction; first copies a database that holds data
/// to <file>.before-<version>. Throws Error(BadInput) for a database that is newer than the program, Error(Transient)
/// for one that is damaged, which names the newest sound copy and how to bring it back.
void migrate(Sqlite& db, const std::vector<Migration>& migrations);

}  // namespace vantage
