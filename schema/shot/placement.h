#pragma once
#include <string>

#include "schema/shot/shot.h"

namespace vantage {

/// Which workers may run jobs. It says nothing of what comes out: no job's key knows it.
struct Placement {
  std::string pool{};  ///< empty: any
  std::string tags{};  ///< words that a worker must all have, in order, one space between
};

/// [farm] pool = "night", tags = ["gpu", "bigmem"], each replaced by what the kind's own table says.
/// Throws Error(BadInput), with file and line, for values of another type.
Placement placement_of(const Shot& shot, const std::string& kind);

/// Takes pool and tags out of a kind's table, where the kind's options would not know them, into the section "farm" as
/// "<kind>.pool" and "<kind>.tags".
void move_placement(Section& kind, Section& farm);

}  // namespace vantage
