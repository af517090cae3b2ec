#pragma once
#include <cstdint>
#include <string>

#include "scheduler/store/sqlite.h"
#include "schema/base/ids.h"

namespace vantage {

/// Why a ready job is not at work, one line for people, from the database as it is: "waits for a worker of pool 'night'
/// with tag 'bigmem': none is alive (2 of that pool are draining)". Empty for a job that is not ready.
/// now_ms: wall clock.
std::string why_waiting(Sqlite& db, JobId job, std::int64_t now_ms);

}  // namespace vantage
