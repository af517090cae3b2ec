#pragma once
#include <map>
#include <string>

#include "scheduler/api/queries.h"

namespace vantage {

using Parameters = std::map<std::string, std::string>;

/// Answer to GET /api/v1<path>, for the server and, without one, for the command line:
///   /shots · /shots/ID · /shots/ID/jobs?kind=&state=&text=&limit=&offset= · /jobs/ID · /workers
/// Throws NotFound for an unknown path, shot or job, Error(BadInput) for a bad parameter.
Json api_get(FarmQueries& queries, const std::string& path, const Parameters& parameters);

/// A whole number, or the fallback when the parameter is not there. Throws Error(BadInput).
std::int64_t integer_parameter(const Parameters& parameters, const std::string& name, std::int64_t fallback);

}  // namespace vantage
