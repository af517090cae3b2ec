#pragma once

namespace vantage {

/// From now on the first SIGINT or SIGTERM is only noted; a second one, half a second later or more, ends the
/// process at once.
void note_stop_signals();
bool stop_was_asked();

}  // namespace vantage
