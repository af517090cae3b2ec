#include "scheduler/upkeep/doctor.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <set>

#include "scheduler/farm/file_system.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

using Level = Finding::Level;

/// A machine on which all is well; tests break one thing.
World good_machine() {
  World world;
  world.folder = [](const std::filesystem::path&) {
    return World::Folder{
        .is_there = true, .is_writable = true, .file_system = "ext4", .error = "", .free_mb = 50'000, .mode = 0600};
  };
  world.text = [](const std::filesystem::path&) { return std::optional<std::string>("8388608\n"); };
  world.run = [](const std::vector<std::string>& argv) {
    return BoundedRun{.exit_code = 0, .timed_out = false, .output = argv[0] + " 1.2.3\nmore"};
  };
  world.get = [](const std::string&, const std::string&) {
    return WebAnswer{.status = 200,
                     .body = R"([{"id": "w1", "build": "1.2.3"}])",
                     .date = "Sun, 22 Nov 2026 12:00:00 GMT",
                     .error = ""};
  };
  world.why_no_bus = world.why_no_loopback = [](const std::string&) { return std::string(); };
  world.limit = [](int) { return std::uint64_t{100'000}; };
  world.wall_ms = [] { return std::int64_t{1'795'348'800'500}; };
  return world;
}

const DoctorRequest kAll{.shot = "/shots/dance",
                         .state_dir = "/no/such/state",
                         .bus = "udpm://239.1.1.1:7667",
                         .server = "http://farm:8080",
                         .token = "",
                         .version = "1.2.3",
                         .worker_program = "/opt/vantage-worker"};

/// What a check says; the worst when it says several things.
Finding finding(const std::string& check, const World& world, const DoctorRequest& request = kAll) {
  Finding worst{.level = Level::Ok, .check = "", .found = "nothing said", .mend = ""};
  for (const Finding& f : examine(request, world))
    if (f.check == check && (worst.check.empty() || f.level > worst.level)) worst = f;
  return worst;
}

void expect(const std::string& check, const World& world, Level level, const std::string& found,
            const std::string& mend) {
  const Finding f = finding(check, world);
  EXPECT_EQ(f.level, level) << check << ": " << f.found;
  EXPECT_NE(f.found.find(found), std::string::npos) << check << ": " << f.found;
  EXPECT_NE(f.mend.find(mend), std::string::npos) << check << ": " << f.mend;
}

TEST(Doctor, FindsNothingOnAGoodMachineAndLooksAtEverything) {
  std::set<std::string> seen;
  for (const Finding& f : examine(kAll, good_machine())) {
    EXPECT_EQ(f.level, Level::Ok) << f.check << ": " << f.found;
    EXPECT_TRUE(f.mend.empty()) << f.check;
    seen.insert(f.check);
  }
  EXPECT_EQ(seen.size(), all_checks().size());
}

TEST(Doctor, LooksOnlyAtWhatIsAsked) {
  for (const Finding& f : examine({.shot = "",
                          .state_dir = "",
                          .bus = "",
                          .server = "",
                          .token = "",
                          .version = "1.2.3",
                          .worker_program = "x"},
                                  good_machine()))
    EXPECT_TRUE(f.check != "store" && f.check != "bus" && f.check != "farm.key" && f.check != "scheduler") << f.check;
}

TEST(Doctor, NamesThePackageOfAMissingProgram) {
  World world = good_machine();
  world.run = [](const std::vector<std::string>&) {
    return BoundedRun{.exit_code = 127, .timed_out = false, .output = ""};
  };
  expect("colmap", world, Level::Fail, "colmap is not there", "apt-get install colmap");
  expect("ffmpeg", world, Level::Fail, "ffmpeg is not there", "apt-get install ffmpeg");
}

TEST(Doctor, SeesProgramsOfDifferentVersions) {
  World world = good_machine();
  world.run = [](const std::vector<std::string>&) {
    return BoundedRun{.exit_code = 0, .timed_out = false, .output = "vantage-worker 0.9\n"};
  };
  expect("worker program", world, Level::Warn, "vantage is 1.2.3", "same build");
  world.get = [](const std::string&, const std::string&) {
    return WebAnswer{.status = 200, .body = R"([{"id": "w7", "build": "1.1"}])", .date = "", .error = ""};
  };
  expect("versions", world, Level::Warn, "w7 runs 1.1", "same version");
}

TEST(Doctor, SeesFolderThatIsMissingReadOnlyOrNearlyFull) {
  World world = good_machine();
  world.folder = [](const std::filesystem::path&) { return World::Folder{}; };
  expect("store", world, Level::Fail, "is not there", "path");
  expect("state folder", world, Level::Fail, "is not there", "vantage farm init");
  expect("farm.key", world, Level::Fail, "is not there", "vantage farm init");
  world.folder = [](const std::filesystem::path&) {
    return World::Folder{.is_there = true,
                         .is_writable = false,
                         .file_system = "ext4",
                         .error = "Read-only file system",
                         .free_mb = 100,
                         .mode = 0644};
  };
  expect("store", world, Level::Fail, "Read-only file system", "mount");
  expect("store's disk", world, Level::Fail, "100 MB free", "vantage gc");
  expect("farm.key", world, Level::Fail, "mode 0644", "chmod 600");
}

TEST(Doctor, RefusesADatabaseOnNetworkStorageButNotAStore) {
  World world = good_machine();
  world.folder = [](const std::filesystem::path&) {
    return World::Folder{
        .is_there = true, .is_writable = true, .file_system = "nfs", .error = "", .free_mb = 50'000, .mode = 0600};
  };
  expect("state folder", world, Level::Fail, "lies on nfs", "disk of this machine");
  expect("store", world, Level::Ok, "on nfs", "");
}

TEST(Doctor, SaysHowToMendTheBus) {
  World world = good_machine();
  world.why_no_bus = [](const std::string&) { return std::string("no route"); };
  expect("bus", world, Level::Fail, "no route", "tcpq://");
  world = good_machine();
  world.why_no_loopback = [](const std::string&) { return std::string("nothing came"); };
  expect("multicast", world, Level::Fail, "nothing came", "ip route add 224.0.0.0/4");
  world.text = [](const std::filesystem::path&) { return std::optional<std::string>("212992\n"); };
  expect("UDP buffer", world, Level::Warn, "212992", "sysctl -w net.core.rmem_max=4194304");
}

TEST(Doctor, SeesASchedulerThatIsAwayWantsATokenOrHasAnotherTime) {
  World world = good_machine();
  world.get = [](const std::string&, const std::string&) {
    return WebAnswer{.status = 0, .body = "", .date = "", .error = "Connection"};
  };
  expect("scheduler", world, Level::Fail, "Connection", "vantage scheduler");
  world.get = [](const std::string&, const std::string&) {
    return WebAnswer{.status = 401, .body = "", .date = "", .error = ""};
  };
  expect("scheduler", world, Level::Fail, "wants a token", "VANTAGE_TOKEN");
  world = good_machine();
  world.wall_ms = [] { return std::int64_t{1'795'348'800'000 + 30'000}; };
  expect("clock", world, Level::Warn, "+30 s", "set-ntp");
  world.wall_ms = [] { return std::int64_t{1'795'348'800'000 - 7'200'000}; };
  expect("clock", world, Level::Fail, "-7200 s", "set-ntp");
}

TEST(Doctor, SeesSmallLimits) {
  World world = good_machine();
  world.limit = [](int resource) { return std::uint64_t{resource == RLIMIT_NOFILE ? 256U : 100'000U}; };
  expect("limits", world, Level::Warn, "256 open files", "ulimit -n");
}

TEST(Doctor, PointsAtTheLineOfABadFarmToml) {
  const TemporaryFolder folder;
  write_file_atomically(folder.path() / "farm.toml", "[farm]\nlese_s = 3\n");
  DoctorRequest request = kAll;
  request.state_dir = folder.path();
  const Finding f = finding("farm.toml", good_machine(), request);
  EXPECT_EQ(f.level, Level::Fail);
  EXPECT_NE(f.found.find("farm.toml:2:"), std::string::npos) << f.found;
}

/// The real machine: whatever it finds, every line is whole.
TEST(Doctor, LooksAtTheRealMachine) {
  const TemporaryFolder folder;
  const auto seen = this_machine().folder(folder.path());
  EXPECT_TRUE(seen.is_there && seen.is_writable);
  EXPECT_GT(seen.free_mb, 0U);
  EXPECT_FALSE(seen.file_system.empty());
  EXPECT_FALSE(this_machine().folder("/no/such/folder").is_there);
  EXPECT_NE(this_machine().why_no_bus("tcpq://127.0.0.1:1"), "");
  EXPECT_GT(this_machine().limit(RLIMIT_NOFILE), 0U);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "farm.sqlite")) << "looking makes nothing";
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "the probe is removed";
}

TEST(FileSystem, NetworkOnesAreRefusedForADatabase) {
  for (const char* name : {"nfs", "cifs", "fuse", "smb2"}) EXPECT_TRUE(is_bad_for_a_database(name)) << name;
  for (const char* name : {"ext4", "xfs", "tmpfs", "overlay"}) EXPECT_FALSE(is_bad_for_a_database(name)) << name;
  EXPECT_NO_THROW(refuse_network_database(std::filesystem::temp_directory_path()));
  EXPECT_THROW(file_system_of("/no/such/folder"), Error);
}

}  // namespace
}  // namespace vantage
