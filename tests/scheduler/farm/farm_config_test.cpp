#include "scheduler/farm/farm_config.h"

#include <gtest/gtest.h>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

class FarmConfigFile : public testing::Test {
 protected:
  FarmConfig read(const std::string& text) {
    write_file_atomically(farm_config_file(folder_.path()), text);
    return read_farm_config(folder_.path());
  }
  /// "" when the text is accepted.
  std::string error_of(const std::string& text) {
    try {
      read(text);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::BadInput);
      return e.what();
    }
    return "";
  }
  void expect_error(const std::string& text, const std::vector<std::string>& parts) {
    const std::string message = error_of(text);
    for (const auto& part : parts) EXPECT_NE(message.find(part), std::string::npos) << part << " not in: " << message;
  }
  TemporaryFolder folder_;
};

const std::string kHash(64, 'a');

TEST_F(FarmConfigFile, AbsentMeansDefaults) {
  const FarmConfig config = read_farm_config(folder_.path());
  EXPECT_EQ(config.server.listen, "127.0.0.1:8080");
  EXPECT_EQ(config.server.lease_s, 15);
  EXPECT_EQ(config.snapshots.keep_hourly, 24);
  EXPECT_TRUE(config.tokens.empty());
}

TEST_F(FarmConfigFile, TablesAreRead) {
  const FarmConfig config = read(
      "[farm]\nlisten = \"0.0.0.0:80\"\nlease_s = 30\n[snapshots]\nevery_min = 0\n[logs]\nkeep_days = 3\n"
      "[[token]]\nname = \"ann\"\nrole = \"operate\"\nsha256 = \"" +
      kHash +
      "\"\n[[notify]]\non = [\"shot_done\", \"disk_low\"]\ncommand = [\"/bin/tell\", \"a b\"]\n"
      "[[notify]]\non = [\"worker_lost\"]\nwebhook = \"http://x/y\"\ntimeout_s = 3\n");
  EXPECT_EQ(config.server.listen, "0.0.0.0:80");
  EXPECT_EQ(config.server.lease_s, 30);
  EXPECT_EQ(config.snapshots.every_min, 0);
  EXPECT_EQ(config.logs.keep_days, 3);
  ASSERT_EQ(config.tokens.size(), 1U);
  EXPECT_TRUE(config.tokens[0].may_operate());
  ASSERT_EQ(config.notify.size(), 2U);
  EXPECT_EQ(config.notify[0].name, "notify1");
  EXPECT_EQ(config.notify[0].command, (std::vector<std::string>{"/bin/tell", "a b"}));
  EXPECT_EQ(config.notify[1].timeout_s, 3);
}

TEST_F(FarmConfigFile, ErrorsSayFileLineAndWhatWasExpected) {
  expect_error("[farm]\nlisten = \"x\"\nlese_s = 3\n", {"farm.toml:3: [farm] lese_s: unknown key", "'lease_s'"});
  expect_error("\n[snapshot]\n", {"farm.toml:2: unknown table [snapshot]", "'snapshots'"});
  expect_error("[farm]\nlease_s = 0\n", {"farm.toml:2: [farm] lease_s: is 0, expected 1 to 3600"});
  expect_error("[farm]\nlease_s = \"5\"\n", {"expected a whole number"});
  expect_error("[farm\n", {"farm.toml:1:", "TOML error"});
  expect_error("[token]\nname = \"a\"\n", {"double brackets"});
  expect_error("[[token]]\nname = \"a\"\nsha256 = \"secret\"\n", {"farm.toml:1: [[token]]", "64 hex digits"});
  expect_error("[[notify]]\non = [\"shot_don\"]\ncommand = [\"x\"]\n", {"farm.toml:2:", "'shot_done'"});
  expect_error("[[notify]]\non = [\"shot_done\"]\n", {"either a command or a webhook"});
  expect_error("[[notify]]\non = [\"shot_done\"]\nwebhook = \"ftp://x\"\n", {"expected http://"});
  expect_error("[[notify]]\non = \"shot_done\"\n", {"expected a list of texts"});
}

TEST_F(FarmConfigFile, WhatInitWritesIsReadAsTheDefaults) {
  FarmConfig::Server server;
  server.listen = "0.0.0.0:8080";
  write_farm_config(folder_.path(), server, {new_token("ann", "operate").entry});
  const FarmConfig config = read_farm_config(folder_.path());
  EXPECT_EQ(config.server.listen, "0.0.0.0:8080");
  ASSERT_EQ(config.tokens.size(), 1U);
  EXPECT_TRUE(config.tokens[0].may_operate());
  EXPECT_EQ(params_to_json(config.snapshots), params_to_json(FarmConfig::Snapshots{}));
  EXPECT_EQ(params_to_json(config.logs), params_to_json(FarmConfig::Logs{}));
}

TEST_F(FarmConfigFile, TokensAreAddedAndTakenOutAndOtherTextStays) {
  const std::string text = "# mine\n[farm]\nlease_s = 9 # long\n";
  read(text);
  add_token(folder_.path(), {.name = "ann", .role = "operate", .sha256 = sha256_hex("one")});
  add_token(folder_.path(), {.name = "bob", .role = "read", .sha256 = sha256_hex("two")});
  EXPECT_THROW(add_token(folder_.path(), {.name = "ann", .role = "read", .sha256 = kHash}), Error);
  remove_token(folder_.path(), "ann");
  const FarmConfig config = read_farm_config(folder_.path());
  ASSERT_EQ(config.tokens.size(), 1U);
  EXPECT_EQ(config.tokens[0].name, "bob");
  EXPECT_EQ(config.tokens[0].sha256, sha256_hex("two"));
  EXPECT_TRUE(read_file(farm_config_file(folder_.path())).starts_with(text));
  EXPECT_THROW(remove_token(folder_.path(), "ann"), Error);
  const auto mode = std::filesystem::status(farm_config_file(folder_.path())).permissions();
  EXPECT_EQ(mode & std::filesystem::perms::group_all, std::filesystem::perms::none);
}

}  // namespace
}  // namespace vantage
