#include "jobs/views/hex_colour.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "schema/base/error.h"

namespace vantage {

std::array<std::uint8_t, 3> rgb_from_hex(const std::string& hex, const std::string& where) {
  const bool is_colour = hex.size() == 7 && hex[0] == '#' &&
                         std::all_of(hex.begin() + 1, hex.end(), [](unsigned char c) { return std::isxdigit(c) != 0; });
  if (!is_colour)
    throw Error(ErrorKind::BadInput, fmt::format("{}: is \"{}\", expected a colour like \"#20a040\"", where, hex));
  const auto level = [&](std::size_t at) {
    return static_cast<std::uint8_t>(std::stoi(hex.substr(at, 2), nullptr, 16));
  };
  return {level(1), level(3), level(5)};
}

}  // namespace vantage
