#pragma once
#include <string>
#include <vector>

namespace vantage {

/// `vantage-worker probe FILE|GLOB…`: what footage is, a line or with json an object each: {path, width, height, fps,
/// num_frames, duration_s, is_stills, warnings} or {path, error}. Returns 0; 2 when one of them is no footage.
int run_probe_command(const std::vector<std::string>& paths, bool json);

}  // namespace vantage
