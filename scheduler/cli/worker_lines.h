#pragma once
#include <cstdint>
#include <string>

#include "schema/base/json.h"

namespace vantage {

/// A worker of GET /workers as people read it: one line, and below it, indented, what is out of the ordinary.
/// now_ms: wall clock.
std::string worker_lines(const Json& worker, std::int64_t now_ms);

}  // namespace vantage
