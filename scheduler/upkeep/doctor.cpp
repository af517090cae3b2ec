#include "scheduler/upkeep/doctor.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <set>

#include "scheduler/farm/farm_config.h"
#include "scheduler/farm/file_system.h"
#include "schema/base/error.h"
#include "schema/base/json.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

using Level = Finding::Level;
using Findings = std::vector<Finding>;

constexpr std::uintmax_t kLowDiskMb = 2'000, kNoDiskMb = 200;
/// LCM's largest datagram times what may wait while the receiver's thread is not scheduled; the default loses bursts.
constexpr std::int64_t kUdpBufferBytes = 4'194'304;
/// The HTTP date has whole seconds.
constexpr std::int64_t kSmallSkewMs = 2'000, kLargeSkewMs = 60'000;
constexpr std::uint64_t kMinOpenFiles = 1024, kMinProcesses = 512;

Finding ok(std::string found) { return {.level = Level::Ok, .check = "", .found = std::move(found), .mend = ""}; }
Finding warn(std::string found, std::string mend) { return {Level::Warn, "", std::move(found), std::move(mend)}; }
Finding fail(std::string found, std::string mend) { return {Level::Fail, "", std::move(found), std::move(mend)}; }

Findings check_program(const World& world, const std::vector<std::string>& argv, const std::string& package,
                       const std::string& why) {
  const BoundedRun run = world.run(argv);
  const std::string first = run.output.substr(0, run.output.find('\n'));
  if (run.exit_code == 127 || run.timed_out)
    return {fail(fmt::format("{} {}: {}", argv[0], run.timed_out ? "does not answer" : "is not there", why),
                 fmt::format("apt-get install {}", package))};
  return {ok(first)};
}

Findings check_colmap(const DoctorRequest&, const World& world) {
  return check_program(world, {"colmap", "help"}, "colmap", "calibrate and fuse need it");
}
Findings check_ffmpeg(const DoctorRequest&, const World& world) {
  return check_program(world, {"ffmpeg", "-version"}, "ffmpeg", "films and sound need it");
}

Findings check_worker_program(const DoctorRequest& request, const World& world) {
  const BoundedRun run = world.run({request.worker_program.string(), "--version"});
  if (run.exit_code == 127)
    return {fail(fmt::format("{}: is not there", request.worker_program.string()),
                 "install vantage and vantage-worker into one folder")};
  const std::string said = run.output.substr(0, run.output.find('\n'));
  if (run.ok() && said.find(request.version) != std::string::npos) return {ok(said)};
  return {warn(fmt::format("vantage is {}, vantage-worker says '{}'", request.version, said),
               "install both from the same build")};
}

Findings check_limits(const DoctorRequest&, const World& world) {
  Findings findings;
  const std::uint64_t files = world.limit(RLIMIT_NOFILE), processes = world.limit(RLIMIT_NPROC);
  if (files < kMinOpenFiles)
    findings.push_back(warn(fmt::format("{} open files per process", files), "ulimit -n 4096"));
  if (processes < kMinProcesses)
    findings.push_back(warn(fmt::format("{} processes per user", processes), "ulimit -u 4096"));
  if (findings.empty()) findings.push_back(ok(fmt::format("{} open files, {} processes", files, processes)));
  return findings;
}

Findings check_time_zone(const DoctorRequest&, const World& world) {
  const auto now_s = static_cast<std::time_t>(world.wall_ms() / 1000);
  std::tm local{};
  localtime_r(&now_s, &local);
  if (now_s < 1'600'000'000)
    return {fail("the clock says that it is before 2020", "timedatectl set-ntp true, or: date -s '…'")};
  return {ok(fmt::format("{} ({:+.1f} h)", local.tm_zone, static_cast<double>(local.tm_gmtoff) / 3600))};
}

Finding disk_space(const fs::path& path, const World::Folder& folder) {
  const std::string found = fmt::format("{}: {} MB free", path.string(), folder.free_mb);
  if (folder.free_mb < kNoDiskMb) return fail(found, "make room: 'vantage gc' lists what may go");
  if (folder.free_mb < kLowDiskMb) return warn(found, "make room: 'vantage gc' lists what may go");
  return ok(found);
}

/// Existence and the right to write; empty when both hold.
Findings trouble_with(const fs::path& path, const World::Folder& folder, const std::string& how_to_make) {
  if (!folder.is_there) return {fail(fmt::format("{}: is not there", path.string()), how_to_make)};
  if (!folder.is_writable)
    return {fail(fmt::format("{}: cannot be written: {}", path.string(), folder.error),
                 "mend the folder's owner or mount it for writing")};
  return {};
}

Findings check_store(const DoctorRequest& request, const World& world) {
  if (request.shot.empty()) return {};
  const fs::path store = request.shot / ".vantage" / "store";
  const auto shot = world.folder(request.shot), folder = world.folder(store);
  if (Findings bad = trouble_with(request.shot, shot, "give the path under which every machine sees the shot");
      !bad.empty())
    return bad;
  if (!folder.is_there) return {ok(fmt::format("{}: not made yet, on {}", store.string(), shot.file_system))};
  if (Findings bad = trouble_with(store, folder, ""); !bad.empty()) return bad;
  return {ok(fmt::format("{}: writable, on {}", store.string(), folder.file_system))};
}

Findings check_store_disk(const DoctorRequest& request, const World& world) {
  if (request.shot.empty()) return {};
  const auto shot = world.folder(request.shot);
  return shot.is_there ? Findings{disk_space(request.shot, shot)} : Findings{};
}

Findings check_state_folder(const DoctorRequest& request, const World& world) {
  if (request.state_dir.empty()) return {};
  const auto folder = world.folder(request.state_dir);
  if (Findings bad =
          trouble_with(request.state_dir, folder, fmt::format("vantage farm init '{}'", request.state_dir.string()));
      !bad.empty())
    return bad;
  if (is_bad_for_a_database(folder.file_system))
    return {fail(
        fmt::format("{}: lies on {}, where a database is not safe", request.state_dir.string(), folder.file_system),
        "give --state a folder on a disk of this machine; stores of shots may stay where they are")};
  return {ok(fmt::format("on {}", folder.file_system)), disk_space(request.state_dir, folder)};
}

Findings check_farm_toml(const DoctorRequest& request, const World& world) {
  if (request.state_dir.empty()) return {};
  const fs::path file = farm_config_file(request.state_dir);
  if (!world.folder(file).is_there) return {ok("not there: defaults")};
  try {
    const FarmConfig config = read_farm_config(request.state_dir);
    return {ok(fmt::format("{} tokens, {} hooks", config.tokens.size(), config.notify.size()))};
  } catch (const Error& e) {
    return {fail(e.what(), "correct that line")};
  }
}

Findings check_farm_key(const DoctorRequest& request, const World& world) {
  if (request.state_dir.empty()) return {};
  const fs::path file = request.state_dir / "farm.key";
  const auto key = world.folder(file);
  if (!key.is_there) return {fail(fmt::format("{}: is not there", file.string()), "vantage farm init makes it")};
  if ((key.mode & 077U) != 0)
    return {fail(fmt::format("{}: others can read it (mode {:04o})", file.string(), key.mode),
                 fmt::format("chmod 600 '{}'", file.string()))};
  return {ok("only its owner can read it")};
}

bool is_multicast(const std::string& bus) { return bus.starts_with("udpm://"); }

Findings check_bus(const DoctorRequest& request, const World& world) {
  if (request.bus.empty()) return {};
  if (const std::string why = world.why_no_bus(request.bus); !why.empty())
    return {fail(fmt::format("{}: {}", request.bus, why),
                 is_multicast(request.bus) ? "add the route, or use the broker: tcpq://host:port"
                                           : "start the scheduler there, or open the port in its firewall")};
  return {ok(fmt::format("{}: reachable", request.bus))};
}

Findings check_multicast(const DoctorRequest& request, const World& world) {
  if (!is_multicast(request.bus)) return {};
  if (const std::string why = world.why_no_loopback(request.bus); !why.empty())
    return {fail(fmt::format("a datagram to the group did not come back: {}", why),
                 "ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo (or the LAN's interface)")};
  return {ok("a datagram to the group came back")};
}

Findings check_udp_buffer(const DoctorRequest& request, const World& world) {
  if (!is_multicast(request.bus)) return {};
  const auto text = world.text("/proc/sys/net/core/rmem_max");
  const std::int64_t bytes = text ? std::atoll(text->c_str()) : 0;
  if (bytes >= kUdpBufferBytes) return {ok(fmt::format("rmem_max is {}", bytes))};
  return {warn(fmt::format("rmem_max is {}: bursts of messages are lost (repeated later, so only slower)", bytes),
               fmt::format("sysctl -w net.core.rmem_max={}", kUdpBufferBytes))};
}

Findings check_server(const DoctorRequest& request, const World& world) {
  if (request.server.empty()) return {};
  const WebAnswer answer = world.get(request.server + "/api/v1/workers", request.token);
  if (answer.status == 0)
    return {fail(fmt::format("{}: {}", request.server, answer.error), "start it: vantage scheduler --state FOLDER")};
  if (answer.status == 401 || answer.status == 403)
    return {fail(fmt::format("{}: wants a token", request.server),
                 "set VANTAGE_TOKEN; 'vantage farm token add' makes one")};
  if (!answer.ok())
    return {fail(fmt::format("{}: answers {}", request.server, answer.status), "is this a scheduler of Vantage?")};
  return {ok(fmt::format("{}: answers", request.server))};
}

Findings check_clock(const DoctorRequest& request, const World& world) {
  if (request.server.empty()) return {};
  const WebAnswer answer = world.get(request.server + "/api/v1/workers", request.token);
  std::tm utc{};
  if (answer.date.empty() || strptime(answer.date.c_str(), "%a, %d %b %Y %H:%M:%S GMT", &utc) == nullptr)
    return {warn("the scheduler does not say what time it is", "nothing to do: leases do not depend on it")};
  const std::int64_t skew_ms = world.wall_ms() - static_cast<std::int64_t>(timegm(&utc)) * 1000;
  const std::string found = fmt::format("{:+.0f} s against the scheduler", static_cast<double>(skew_ms) / 1000);
  if (std::abs(skew_ms) <= kSmallSkewMs) return {ok(found)};
  return {Finding{std::abs(skew_ms) > kLargeSkewMs ? Level::Fail : Level::Warn, "",
                  found + ": times in logs and reports will puzzle people; no lease depends on it",
                  "timedatectl set-ntp true"}};
}

Findings check_versions(const DoctorRequest& request, const World& world) {
  if (request.server.empty()) return {};
  const WebAnswer answer = world.get(request.server + "/api/v1/workers", request.token);
  const Json workers = Json::parse(answer.body, nullptr, /*allow_exceptions=*/false);
  const Json list = workers.is_object() && workers.contains("workers") ? workers.at("workers") : workers;
  if (!answer.ok() || !list.is_array()) return {};
  std::set<std::string> others;
  int num_said = 0;
  for (const Json& worker : list) {
    if (!worker.is_object()) continue;
    const std::string build = worker.value("build", "");
    num_said += build.empty() ? 0 : 1;
    if (!build.empty() && build != request.version)
      others.insert(fmt::format("{} runs {}", worker.value("id", "?"), build));
  }
  if (others.empty())
    return {ok(
        fmt::format("{} of {} workers say theirs, none is another than {}", num_said, list.size(), request.version))};
  return {warn(fmt::format("this is {}, but {}", request.version, fmt::join(others, ", ")),
               "install the same version everywhere; other ones are given only jobs that they know")};
}

}  // namespace

std::string_view to_string(Level level) { return level == Level::Ok ? "ok" : level == Level::Warn ? "warn" : "fail"; }

const std::vector<Check>& all_checks() {
  static const std::vector<Check> checks{{"colmap", check_colmap},
                                         {"ffmpeg", check_ffmpeg},
                                         {"worker program", check_worker_program},
                                         {"limits", check_limits},
                                         {"time zone", check_time_zone},
                                         {"store", check_store},
                                         {"store's disk", check_store_disk},
                                         {"state folder", check_state_folder},
                                         {"farm.toml", check_farm_toml},
                                         {"farm.key", check_farm_key},
                                         {"bus", check_bus},
                                         {"multicast", check_multicast},
                                         {"UDP buffer", check_udp_buffer},
                                         {"scheduler", check_server},
                                         {"clock", check_clock},
                                         {"versions", check_versions}};
  return checks;
}

Findings examine(const DoctorRequest& request, const World& world) {
  Findings all;
  for (const Check& check : all_checks())
    for (Finding& finding : check.look(request, world)) {
      finding.check = check.name;
      all.push_back(std::move(finding));
    }
  return all;
}

}  // namespace vantage
