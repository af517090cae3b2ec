#pragma once
#include <string>

#include "scheduler/dispatch/command.h"
#include "scheduler/farm/farm.h"

namespace vantage {

/// Bodies of requests that change something: JSON from anybody. Throw Error(BadInput) for what is not an object, has an
/// unknown member (with a suggestion) or one of another type.

/// {"folder": "/absolute", "until": "stage", "priority": 0}
SubmitRequest read_submission(const std::string& body);
/// {"stage": "depth", "priority": 5, "dry_run": true}, or nothing; into a command whose verb and target are set.
Command read_order(Command command, const std::string& body);

}  // namespace vantage
