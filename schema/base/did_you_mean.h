#pragma once
#include <span>
#include <string>
#include <string_view>

namespace vantage {

/// The candidate nearest to `word` by edit distance, as " (did you mean 'x'?)"; empty when none is near.
std::string did_you_mean(std::string_view word, std::span<const std::string> candidates);

}  // namespace vantage
