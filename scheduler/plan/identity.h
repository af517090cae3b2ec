#pragma once
#include <string>

#include "schema/base/json.h"
#include "schema/formats/job_file.h"

namespace vantage {

/// What a job's key is made of, kept so that the next key's difference can be named:
/// {version, params, unit, inputs: {job: content}, sources: {name: content}}.
Json identity_of(const JobFile& job);

/// Why a job with the new identity is not the job with the old one: "params.sigma 1.2 → 1.4, input calibrate changed".
/// Names at most three differences and counts the others. Empty when they are equal.
std::string explain_change(const Json& old_identity, const Json& new_identity);

}  // namespace vantage
