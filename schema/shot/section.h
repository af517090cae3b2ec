#pragma once
#include <map>
#include <string>

#include "schema/base/json.h"

namespace vantage {

/// One value of a TOML table and where it stands, for messages that point at it.
struct LocatedValue {
  Json value;
  int line = 0;
};

/// A flat table of shot.toml, e.g. [correspond].
struct Section {
  std::string file;  ///< path of shot.toml as messages should print it
  std::string name;  ///< "correspond"
  int line = 0;      ///< 0 when the table is absent: all defaults
  std::map<std::string, LocatedValue> values;
  bool present() const { return line > 0; }
  /// "shot.toml:12: [correspond] max_error_px"
  std::string where(const std::string& key) const;
};

}  // namespace vantage
