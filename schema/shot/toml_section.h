#pragma once
#include <toml++/toml.h>

#include <filesystem>
#include <string>

#include "schema/shot/section.h"

namespace vantage {

/// Parses a file. Throws Error(BadInput) "file:line:column: TOML error: …".
toml::table parse_toml(const std::filesystem::path& file);

int line_of(const toml::node& node);
Json to_json(const toml::node& node);

/// A table of `file` as values with their lines; tables within it become JSON objects.
Section flat_section(const toml::table& table, const std::string& file, const std::string& name);

}  // namespace vantage
