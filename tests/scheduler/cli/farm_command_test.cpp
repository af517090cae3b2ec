// `vantage farm`: what lies in the folder afterwards, and who may read it.
#include <gtest/gtest.h>

#include "scheduler/farm/farm_config.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "tests/scheduler/cli/vantage_program.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

class FarmCommand : public testing::Test {
 protected:
  std::string state() const { return (folder_.path() / "farm").string(); }
  TemporaryFolder folder_;
};

TEST_F(FarmCommand, InitMakesKeyTokensAndDatabaseAndKeepsNoSecret) {
  const Ended made = vantage("farm init " + state() + " --listen 127.0.0.1:0 --json");
  ASSERT_EQ(made.exit_code, 0) << made.output;
  const Json facts = Json::parse(made.output);
  for (const char* name : {"farm.key", "farm.toml"})
    EXPECT_EQ(fs::status(fs::path(state()) / name).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  const FarmConfig config = read_farm_config(state());
  EXPECT_EQ(config.server.listen, "127.0.0.1:0");
  ASSERT_EQ(config.tokens.size(), 2U);
  EXPECT_EQ(config.tokens[0].sha256, sha256_hex(facts.at("operate_token").get<std::string>()));
  EXPECT_TRUE(config.tokens[0].may_operate());
  EXPECT_FALSE(config.tokens[1].may_operate());
  EXPECT_EQ(read_file(state() + "/farm.toml").find(facts.at("operate_token").get<std::string>()), std::string::npos);
  EXPECT_TRUE(fs::exists(state() + "/farm.sqlite"));
}

TEST_F(FarmCommand, InitRefusesToOverwriteAFarm) {
  ASSERT_EQ(vantage("farm init " + state()).exit_code, 0);
  const std::string key = read_file(state() + "/farm.key");
  expect_misuse(vantage("farm init " + state()), "a farm is here already");
  EXPECT_EQ(read_file(state() + "/farm.key"), key);
}

TEST_F(FarmCommand, TokensAreAddedListedAndRemoved) {
  ASSERT_EQ(vantage("farm init " + state()).exit_code, 0);
  const Ended added = vantage("farm token add ann --role operate --state " + state());
  ASSERT_EQ(added.exit_code, 0) << added.output;
  const std::string text = added.output.substr(0, added.output.find('\n'));
  EXPECT_EQ(read_farm_config(state()).tokens.back().sha256, sha256_hex(text));
  EXPECT_NE(vantage("farm token list --state " + state()).output.find("ann"), std::string::npos);
  expect_misuse(vantage("farm token add ann --state " + state()), "has a token 'ann' already");
  EXPECT_EQ(vantage("farm token remove ann --state " + state()).exit_code, 0);
  expect_misuse(vantage("farm token remove ann --state " + state()), "has no token 'ann'");
}

TEST_F(FarmCommand, SchedulerNamesTheLineOfABadFarmToml) {
  ASSERT_EQ(vantage("farm init " + state()).exit_code, 0);
  write_file_atomically(state() + "/farm.toml", "[farm]\nlease_s = 0\n");
  expect_misuse(vantage("scheduler --state " + state()), "farm.toml:2: [farm] lease_s: is 0, expected 1 to 3600");
}

}  // namespace
}  // namespace vantage
