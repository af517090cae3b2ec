#pragma once
#include <string_view>

namespace vantage {

/// scheduler/api/openapi.json, inside the binary.
std::string_view openapi_text();

}  // namespace vantage
