#pragma once
#include <string>
#include <vector>

#include "jobs/kind_entry.h"
#include "scheduler/cli/command_table.h"

namespace vantage {

/// How `vantage scheduler` was asked to serve.
struct ServeOptions {
  std::string state_dir, listen = "127.0.0.1:8080", bus, bus_listen = "127.0.0.1";
  int bus_port = 7700;
  int lease_ms = 15000;
};
ServeOptions parse_serve_options(const Arguments& arguments);

/// Scheduler, page and API until a stop signal. kinds: what shots may be planned with. Returns the exit code.
int serve_farm(const ServeOptions& options, const std::vector<KindEntry>& kinds);

}  // namespace vantage
