#include "worker/children.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>

#include <fstream>
#include <thread>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

constexpr AttemptRef kRef{1, 1, 1};

struct ChildrenTest : ::testing::Test {
  TemporaryFolder folder;
  Children children;

  std::filesystem::path log() const { return folder.path() / "logs" / "1.log"; }
  void start_shell(const std::string& script) { children.start({kRef, {"/bin/sh", "-c", script}, log()}); }
  Children::Ended wait_for_end() {
    for (int i = 0; i < 100; ++i) {
      pollfd p{.fd = children.exit_fds().at(0), .events = POLLIN, .revents = 0};
      poll(&p, 1, 100);
      const auto ended = children.reap();
      if (!ended.empty()) return ended[0];
    }
    ADD_FAILURE() << "the child does not end";
    return {};
  }
  /// The log, as soon as it has a line.
  std::string wait_for_log() {
    for (int i = 0; i < 10'000; ++i) {
      if (const std::string text = read_file(log()); text.ends_with('\n')) return text;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ADD_FAILURE() << "the child says nothing";
    return "";
  }
};

TEST_F(ChildrenTest, OutputGoesToTheLogAndTheStatusComesBack) {
  start_shell("echo out; echo err >&2; exit 3");
  const auto ended = wait_for_end();
  EXPECT_EQ(ended.ref, kRef);
  EXPECT_EQ(ended.exit_code, 3);
  EXPECT_EQ(ended.signal, 0);
  EXPECT_EQ(read_file(log()), "out\nerr\n");
  EXPECT_TRUE(children.running().empty());
}

TEST_F(ChildrenTest, RealSegmentationFaultIsSeen) {
  start_shell("kill -SEGV $$");
  EXPECT_EQ(wait_for_end().signal, SIGSEGV);
}

TEST_F(ChildrenTest, KillMinusNineIsSeen) {
  start_shell("kill -9 $$");
  EXPECT_EQ(wait_for_end().signal, SIGKILL);
}

TEST_F(ChildrenTest, SignalReachesTheWholeGroup) {
  start_shell("trap '' TERM; sleep 1000 & echo $!; wait; wait");
  const pid_t grandchild = std::stoi(wait_for_log());
  children.signal_group(kRef, SIGKILL);
  EXPECT_EQ(wait_for_end().signal, SIGKILL);
  for (int i = 0; i < 10'000 && kill(grandchild, 0) == 0; ++i) {
    std::ifstream stat("/proc/" + std::to_string(grandchild) + "/stat");
    std::string pid, name, state;
    if (!(stat >> pid >> name >> state) || state == "Z") return;  // dead; init has not fetched it yet
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_NE(kill(grandchild, 0), 0);
}

TEST_F(ChildrenTest, InheritsNoDescriptorsAndNoBlockedSignals) {
  const std::ofstream open_file(folder.path() / "open");
  start_shell("ls /proc/self/fd | wc -l; grep SigIgn /proc/self/status; cat /proc/self/oom_score_adj");
  wait_for_end();
  EXPECT_EQ(read_file(log()), "4\nSigIgn:\t0000000000000000\n500\n") << "0, 1, 2 and the one that ls lists with";
}

TEST_F(ChildrenTest, MemoryOfDescendantsCounts) {
  start_shell("/bin/sh -c 'echo ready; sleep 1000'; :");
  wait_for_log();
  EXPECT_GT(children.rss_mb(kRef), 0);
  EXPECT_EQ(children.rss_mb({2, 2, 2}), 0);
}

TEST_F(ChildrenTest, ProgramThatIsNotThereIsSaidAtOnce) {
  EXPECT_THROW(children.start({kRef, {"/no/such/program"}, log()}), Error);
  EXPECT_TRUE(children.running().empty());
}

TEST_F(ChildrenTest, DestructorLeavesNobodyBehind) {
  pid_t pid = 0;
  {
    Children mine;
    mine.start({kRef, {"/bin/sh", "-c", "echo $$; sleep 1000"}, log()});
    pid = std::stoi(wait_for_log());
  }
  EXPECT_NE(kill(pid, 0), 0);
}

}  // namespace
}  // namespace vantage
