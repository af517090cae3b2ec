#include "worker/probe_command.h"

#include <fmt/format.h>

#include <cstdio>

#include "jobs/ingest/probe.h"
#include "schema/base/error.h"
#include "schema/base/json.h"

namespace vantage {
namespace {

Json to_json(const std::string& path, const FootageProbe& p) {
  return {{"path", path},
          {"width", p.width},
          {"height", p.height},
          {"fps", p.fps},
          {"num_frames", p.num_frames},
          {"duration_s", p.duration_s},
          {"is_stills", p.is_stills},
          {"warnings", p.warnings}};
}

void print_line(const std::string& path, const FootageProbe& p) {
  fmt::print("{}: {} x {} px, {:.3f} fps, {} {}, {:.2f} s\n", path, p.width, p.height, p.fps, p.num_frames,
             p.is_stills ? "stills" : "frames", p.duration_s);
  for (const std::string& warning : p.warnings) fmt::print("{}: warning: {}\n", path, warning);
}

}  // namespace

int run_probe_command(const std::vector<std::string>& paths, bool json) {
  Json all = Json::array();
  int exit_code = 0;
  for (const std::string& path : paths) {
    try {
      const FootageProbe probe = probe_footage(path);
      if (json)
        all.push_back(to_json(path, probe));
      else
        print_line(path, probe);
    } catch (const Error& e) {
      exit_code = 2;
      if (json)
        all.push_back({{"path", path}, {"error", e.what()}});
      else
        fmt::print(stderr, "error: {}\n", e.what());
    }
  }
  if (json) fmt::print("{}\n", all.dump(1, ' ', false, Json::error_handler_t::replace));
  return exit_code;
}

}  // namespace vantage
