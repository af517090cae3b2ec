// The real program with real arguments: exit codes and the one line that says what is wrong.
#include <gtest/gtest.h>

#include "schema/base/files.h"
#include "schema/base/json.h"
#include "tests/scheduler/api/small_farm.h"
#include "tests/scheduler/cli/vantage_program.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

class CommandLine : public testing::Test {
 protected:
  /// Writes SHOT/shot.toml and returns SHOT.
  std::string shot(const std::string& toml) {
    const fs::path shot = folder_.path() / "shot";
    fs::create_directories(shot);
    write_file_atomically(shot / "shot.toml", toml);
    return shot.string();
  }
  static std::string cameras(const std::string& first = "a.mp4") {
    return "[[camera]]\nname = \"a\"\nfootage = \"" + first + "\"\n[[camera]]\nname = \"b\"\nfootage = \"b.mp4\"\n";
  }
  TemporaryFolder folder_;
};

TEST_F(CommandLine, HelpListsEveryCommand) {
  const Ended help = vantage("help");
  EXPECT_EQ(help.exit_code, 0);
  for (const char* name : {"init", "check", "run", "scheduler", "submit", "status", "jobs", "logs", "why", "workers"})
    EXPECT_NE(help.output.find(std::string("vantage ") + name), std::string::npos) << name;
  EXPECT_EQ(vantage("").exit_code, 2);
  EXPECT_EQ(vantage("run --help").exit_code, 0);
}

TEST_F(CommandLine, SuggestsTheCommandThatWasMeant) { expect_misuse(vantage("chek x"), "did you mean 'check'?"); }
TEST_F(CommandLine, NamesAnUnknownOption) { expect_misuse(vantage("check x --jsn"), "--jsn"); }
TEST_F(CommandLine, SuggestsTheStageThatWasMeant) {
  expect_misuse(vantage("run x --until calibrte"), "did you mean 'calibrate'?");
}

TEST_F(CommandLine, EveryCommandSaysThatThereIsNoSuchShot) {
  for (const char* command : {"check", "run", "status", "jobs"})
    expect_misuse(vantage(std::string(command) + " /no/such/shot"), "/no/such/shot");
}

TEST_F(CommandLine, PointsAtLineAndColumnOfATomlError) {
  expect_misuse(vantage("check " + shot("[shot]\nname = = 3\n")), "shot.toml:2:8: TOML error");
}

TEST_F(CommandLine, SuggestsTheTableThatWasMeant) {
  expect_misuse(vantage("run " + shot(cameras() + "[calibrat]\n")),
                "unknown table [calibrat] (did you mean 'calibrate'?)");
}

TEST_F(CommandLine, SuggestsTheKeyThatWasMeant) {
  const std::string folder = shot(cameras() + "[calibrate]\nmethd = \"known\"\n");
  for (const char* footage : {"/a.mp4", "/b.mp4"}) write_file_atomically(folder + footage, "not looked into");
  expect_misuse(vantage("check " + folder), "shot.toml:8: [calibrate] methd: unknown key (did you mean 'method'?)");
}

TEST_F(CommandLine, NamesMissingFootageAndItsLine) {
  expect_misuse(vantage("check " + shot(cameras())), "shot.toml:1: camera 'a' names a.mp4, which does not exist");
  expect_misuse(vantage("run " + shot(cameras())), "which does not exist");
}

TEST_F(CommandLine, RefusesASingleCamera) {
  expect_misuse(vantage("check " + shot("[[camera]]\nname = \"a\"\nfootage = \"a.mp4\"\n")), "has 1 camera");
}

TEST_F(CommandLine, RefusesFootageThatIsNoVideo) {
  const std::string folder = shot(cameras());
  write_file_atomically(folder + "/a.mp4", "this is text");
  write_file_atomically(folder + "/b.mp4", "this is text");
  const Ended ended = vantage("check " + folder);
  EXPECT_EQ(ended.exit_code, 2) << ended.output;
  EXPECT_NE(ended.output.find("a.mp4"), std::string::npos) << ended.output;
}

TEST_F(CommandLine, CheckChangesNothing) {
  const std::string folder = shot(cameras());
  vantage("check " + folder);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator{}), 1);
}

TEST_F(CommandLine, InitKeepsAShotThatIsThere) {
  const std::string folder = shot("precious");
  expect_misuse(vantage("init " + folder + " --camera x.mp4"), "--force replaces it");
  EXPECT_EQ(read_file(folder + "/shot.toml"), "precious");
}

class AskingCommands : public testing::Test {
 protected:
  Ended ask(const std::string& command, const std::string& rest = "") {
    return vantage(command + " " + farm_.shot().string() + " " + rest);
  }
  SmallFarm farm_;
};

TEST_F(AskingCommands, StatusCountsPerStage) {
  const Ended status = ask("status");
  EXPECT_EQ(status.exit_code, 0);
  EXPECT_NE(status.output.find("dance: running"), std::string::npos) << status.output;
  EXPECT_NE(status.output.find("1 failed"), std::string::npos) << status.output;
  EXPECT_EQ(Json::parse(ask("status", "--json").output).at("counts").at("blocked"), 6);
}

TEST_F(AskingCommands, JobsFilterByStageAndState) {
  EXPECT_EQ(Json::parse(ask("jobs", "--json --kind render").output).at("total"), 6);
  EXPECT_EQ(Json::parse(ask("jobs", "--json --state failed").output).at("total"), 1);
  expect_misuse(ask("jobs", "--state faild"), "did you mean 'failed'?");
}

TEST_F(AskingCommands, WhySaysErrorAttemptsAndWhatAJobWaitsFor) {
  EXPECT_NE(ask("why", "depth/left-000000").output.find("no edge <with> depth"), std::string::npos);
  EXPECT_NE(ask("why", "render/freeze/000000").output.find("waits for correspond/left-000000__left-000001 (running)"),
            std::string::npos);
}

TEST_F(AskingCommands, LogsPrintTheLogAndSuggestNames) {
  EXPECT_EQ(ask("logs", "depth/left-000000").output, "reading maps\nno edge with depth\n");
  expect_misuse(ask("logs", "depth/left-000001"), "did you mean 'depth/left-000000'?");
}

TEST_F(AskingCommands, WorkersAreListed) { EXPECT_NE(ask("workers").output.find("studio"), std::string::npos); }

TEST_F(AskingCommands, OrdersNeedAServerThatAnswers) {
  expect_misuse(ask("retry"), "--server");
  EXPECT_EQ(ask("retry", "--server http://127.0.0.1:1").exit_code, 1);
}

}  // namespace
}  // namespace vantage
