#pragma once
#include <cstdint>
#include <string>

#include "schema/base/json.h"

namespace vantage {

/// The one honest sentence on a running shot: "73 %, done sun 04:10 (03:40-05:05), 2 quarantined, 11 retried, worker b3
/// set aside (disk)". counts: as GET /shots/ID says; estimate: as GET /shots/ID/estimate; workers: as GET /workers.
/// now_ms: wall clock.
std::string estimate_line(const Json& counts, const Json& estimate, const Json& workers, std::int64_t now_ms);

}  // namespace vantage
