#pragma once
#include <string_view>

#include "scheduler/store/rows.h"
#include "scheduler/store/sqlite.h"

namespace vantage {

/// What job_from() reads, in its order.
inline constexpr std::string_view kJobColumns =
    "id, shot_id, name, kind, stage, version, generation, plan_hash, params, unit, sources, links, key, identity, "
    "content, "
    "state, priority, num_unmet, cores, ram_mb, timeout_s, num_attempts, num_failures, num_crashes, not_before_ms, "
    "reason, pool, tags";

JobRow job_from(const Query& query);

}  // namespace vantage
