#include "worker/children.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"
#include "worker/fork_server.h"

namespace vantage {
namespace {

constexpr AttemptRef kRef{1, 1, 1};

/// A fork server in a forked test process; its children run the request's spec as a shell script. "outcome: TEXT" and
/// "progress: PHASE" are told through the link instead.
int run_script(const ChildRequest& request, ChildLink& link) {
  if (request.spec.starts_with("progress: ")) {
    link.progress(0.25, request.spec.substr(10));
    link.progress(0.5, "too soon after the first");
    pause();
  }
  if (request.spec.starts_with("outcome: ")) {
    link.outcome({.ref = request.ref,
                  .outcome = Outcome::Done,
                  .error_kind = {},
                  .message = {},
                  .content = request.spec.substr(9)});
    return 0;
  }
  execl("/bin/sh", "sh", "-c", request.spec.c_str(), nullptr);
  return 127;
}
void become_server(int socket) { _exit(run_fork_server(socket, run_script)); }

struct ChildrenTest : ::testing::Test {
  TemporaryFolder folder;
  Children children{become_server};

  std::filesystem::path log() const { return folder.path() / "logs" / "1.log"; }
  void start(const std::string& script, AttemptRef ref = kRef) {
    children.start({.ref = ref, .spec = script, .log_path = log().string()});
  }
  /// News that the predicate wants; empty after 10 s.
  template <class Wanted>
  Children::News wait_for(Wanted wanted) {
    for (int i = 0; i < 100; ++i) {
      pollfd p{.fd = children.fd(), .events = POLLIN, .revents = 0};
      poll(&p, 1, 100);
      Children::News news = children.take();
      if (wanted(news)) return news;
    }
    ADD_FAILURE() << "waited in vain";
    return {};
  }
  Children::Ended wait_for_end() {
    const auto news = wait_for([](const Children::News& n) { return !n.ended.empty(); });
    return news.ended.empty() ? Children::Ended{} : news.ended[0];
  }
  /// The log, as soon as it has a line.
  std::string wait_for_log() {
    for (int i = 0; i < 10'000; ++i) {
      std::ifstream in(log());
      const std::string text{std::istreambuf_iterator<char>(in), {}};
      if (text.ends_with('\n')) return text;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ADD_FAILURE() << "the child says nothing";
    return "0";
  }
};

/// Dead, or a zombie that init has not fetched yet.
bool is_gone(pid_t pid) {
  for (int i = 0; i < 10'000; ++i) {
    std::ifstream stat("/proc/" + std::to_string(pid) + "/stat");
    std::string its_pid, name, state;
    if (!(stat >> its_pid >> name >> state) || state == "Z") return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

TEST_F(ChildrenTest, OutputGoesToTheLogAndTheStatusComesBack) {
  start("echo out; echo err >&2; exit 3");
  const auto ended = wait_for_end();
  EXPECT_EQ(ended.ref, kRef);
  EXPECT_EQ(ended.exit_code, 3);
  EXPECT_EQ(ended.signal, 0);
  EXPECT_FALSE(ended.has_outcome);
  EXPECT_EQ(read_file(log()), "out\nerr\n");
  EXPECT_TRUE(children.running().empty());
}

TEST_F(ChildrenTest, OutcomeComesWithTheEnd) {
  start("outcome: 00ff");
  const auto ended = wait_for_end();
  EXPECT_TRUE(ended.has_outcome);
  EXPECT_EQ(ended.outcome.content, "00ff");
}

TEST_F(ChildrenTest, ProgressIsToldAtMostFiveTimesASecond) {
  start("progress: warping");
  for (int i = 0; i < 1'000 && children.progress(kRef).phase != "warping"; ++i) {
    pollfd p{.fd = children.fd(), .events = POLLIN, .revents = 0};
    poll(&p, 1, 10);
    children.take();
  }
  EXPECT_EQ(children.progress(kRef).phase, "warping");
  EXPECT_EQ(children.progress(kRef).fraction, 0.25);
}

TEST_F(ChildrenTest, RealSegmentationFaultIsSeen) {
  start("kill -SEGV $$");
  EXPECT_EQ(wait_for_end().signal, SIGSEGV);
}

TEST_F(ChildrenTest, KillMinusNineIsSeen) {
  start("kill -9 $$");
  EXPECT_EQ(wait_for_end().signal, SIGKILL);
}

TEST_F(ChildrenTest, SignalReachesTheWholeGroup) {
  start("trap '' TERM; sleep 1000 & echo $!; wait; wait");
  const pid_t grandchild = std::stoi(wait_for_log());
  children.signal_group(kRef, SIGKILL);
  EXPECT_EQ(wait_for_end().signal, SIGKILL);
  EXPECT_TRUE(is_gone(grandchild));
}

TEST_F(ChildrenTest, InheritsNoDescriptorsAndNoBlockedSignals) {
  const std::ofstream open_file(folder.path() / "open");
  start("ls /proc/self/fd | wc -l; grep -E 'SigBlk|SigIgn' /proc/self/status; cat /proc/self/oom_score_adj");
  wait_for_end();
  EXPECT_EQ(read_file(log()), "4\nSigBlk:\t0000000000000000\nSigIgn:\t0000000000000000\n500\n")
      << "0, 1, 2 and the one that ls lists with";
}

TEST_F(ChildrenTest, MemoryOfDescendantsCounts) {
  start("/bin/sh -c 'echo ready; sleep 1000'; :");
  wait_for_log();
  children.take();
  EXPECT_GT(children.usage(kRef).rss_mb, 0);
  EXPECT_EQ(children.usage({2, 2, 2}).rss_mb, 0);
}

TEST_F(ChildrenTest, LogThatCannotBeOpenedIsTheOutcome) {
  std::ofstream(folder.path() / "logs") << "a file, not a folder";
  start("true");
  const auto ended = wait_for_end();
  EXPECT_EQ(ended.outcome.outcome, Outcome::Failed);
  EXPECT_EQ(ended.outcome.error_kind, "transient");
  EXPECT_NE(ended.outcome.message.find("cannot open the log"), std::string::npos);
}

TEST_F(ChildrenTest, DeadForkServerLosesItsChildrenAndIsReplaced) {
  start("echo $$ $PPID; sleep 1000");
  std::istringstream line(wait_for_log());
  pid_t child = 0, server = 0;
  line >> child >> server;
  kill(server, SIGKILL);
  const auto news = wait_for([](const Children::News& n) { return !n.lost.empty(); });
  EXPECT_EQ(news.lost, std::vector<AttemptRef>{kRef});
  EXPECT_TRUE(is_gone(child));
  start("exit 5", {2, 1, 1});
  EXPECT_EQ(wait_for_end().exit_code, 5);
}

TEST_F(ChildrenTest, DestructorLeavesNobodyBehind) {
  pid_t pid = 0;
  {
    Children mine{become_server};
    mine.start({.ref = kRef, .spec = "echo $$; sleep 1000", .log_path = log().string()});
    pid = std::stoi(wait_for_log());
  }
  EXPECT_TRUE(is_gone(pid));
}

}  // namespace
}  // namespace vantage
