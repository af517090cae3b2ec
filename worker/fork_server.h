#pragma once
#include <functional>

#include "worker/child_link.h"

namespace vantage {

/// What a child does; the return value is its exit status.
using ChildMain = std::function<int(const ChildRequest& request, ChildLink& link)>;

/// Where `vantage-worker fork-server` finds its socket.
constexpr int kForkServerSocket = 3;

/// Forks a child for each request that comes through the socket and tells how it ended, until the socket closes.
/// A process of its own with all libraries loaded and no threads: forking it costs a fraction of loading them again.
/// A child is the leader of its own process group, is killed with the server (which is killed with its worker), and is
/// preferred by the kernel when memory runs out. Returns the exit status.
int run_fork_server(int socket, const ChildMain& child_main);

}  // namespace vantage
