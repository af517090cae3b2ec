#pragma once
#include <array>
#include <cstdint>
#include <string>

namespace vantage {

/// Red, green, blue of "#20a040", as filmed or shown (sRGB levels). Throws Error(BadInput) for anything else; where:
/// begins the message, e.g. "shot.toml:12: camera 'left' key_color".
std::array<std::uint8_t, 3> rgb_from_hex(const std::string& hex, const std::string& where);

}  // namespace vantage
