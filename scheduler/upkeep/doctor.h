#pragma once
/// `vantage doctor`: what may be wrong with a machine, a farm's folder, a shot's store or the network, and what mends
/// it. Each check is a plain function of what is asked and of a World, so that tests need no real fault.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "scheduler/upkeep/bounded_program.h"
#include "scheduler/upkeep/web_client.h"

namespace vantage {

/// What a person asks about; what is empty is not looked at.
struct DoctorRequest {
  std::filesystem::path shot, state_dir;
  std::string bus;      ///< LCM URL
  std::string server;   ///< "http://host:port"
  std::string token;    ///< for the server
  std::string version;  ///< of this program
  std::filesystem::path worker_program;
};

/// What checks look at. Members never throw; what is not there is empty.
struct World {
  struct Folder {
    bool is_there = false, is_writable = false;
    std::string file_system, error;
    std::uintmax_t free_mb = 0;
    unsigned mode = 0;  ///< permissions, 0777 and less
  };
  std::function<Folder(const std::filesystem::path&)> folder;  ///< or file; is_writable only of folders
  std::function<std::optional<std::string>(const std::filesystem::path&)> text;
  std::function<BoundedRun(const std::vector<std::string>& argv)> run;
  std::function<WebAnswer(const std::string& url, const std::string& token)> get;
  std::function<std::string(const std::string& bus)> why_no_bus;       ///< empty: reachable
  std::function<std::string(const std::string& bus)> why_no_loopback;  ///< of multicast
  std::function<std::uint64_t(int resource)> limit;                    ///< getrlimit, soft
  std::function<std::int64_t()> wall_ms;
};
World this_machine();

struct Finding {
  enum class Level { Ok, Warn, Fail };
  Level level = Level::Ok;
  std::string check;  ///< "clock"
  std::string found;
  std::string mend;  ///< a command or a sentence; empty when all is well
};
std::string_view to_string(Finding::Level level);

struct Check {
  const char* name;
  std::vector<Finding> (*look)(const DoctorRequest&, const World&);
};
/// In the order in which they are shown.
const std::vector<Check>& all_checks();

std::vector<Finding> examine(const DoctorRequest& request, const World& world);

}  // namespace vantage
