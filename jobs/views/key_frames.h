#pragma once
#include <vector>

#include "schema/shot/shot.h"

namespace vantage {

/// The path at output time at_s, through all key frames: monotone cubic (monotone_cubic.h), each value on its
/// own. Between equal values a value stays exactly put (freeze and rotate), it never overshoots a key, two keys make a
/// straight line; before the first and after the last key the path stands still. keys: at least one, at_s rising.
KeyFrame path_at(const std::vector<KeyFrame>& keys, double at_s);

/// Numbers n of the output frames of a path: those with first at_s <= n / fps <= last at_s; at least one.
std::vector<int> path_frames(const std::vector<KeyFrame>& keys, double fps);

}  // namespace vantage
