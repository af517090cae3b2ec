#pragma once
#include <string>
#include <vector>

#include "schema/base/json.h"

namespace vantage {

/// Where a value breaks an OpenAPI 3.0 schema: "/jobs/0/state: …"; empty when it fits. Knows type, nullable, enum,
/// required, properties, additionalProperties, items, minimum, maximum and $ref into `document`; any other word in a
/// schema that would forbid something is itself reported.
std::vector<std::string> schema_violations(const Json& document, const Json& schema, const Json& value);

}  // namespace vantage
