#pragma once
#include <string>

#include "schema/messages/transport.h"

namespace vantage {

/// Whether something accepts connections there, waiting at most timeout_ms. Empty = yes, else why not.
std::string why_no_tcp_connection(const LcmUrl& url, int timeout_ms);
/// Empty when the machine has a route for the multicast address, else what is wrong and the commands that mend it.
std::string why_no_multicast(const LcmUrl& url);

}  // namespace vantage
