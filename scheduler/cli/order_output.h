#pragma once
#include "schema/base/json.h"

namespace vantage {

/// Prints what an order did or, of a dry run, would do, with the names of what it touches.
void print_order_result(const Json& answer, bool dry_run, bool json);

}  // namespace vantage
