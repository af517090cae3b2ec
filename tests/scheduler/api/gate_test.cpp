#include "scheduler/api/gate.h"

#include <sys/stat.h>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "tests/scheduler/api/api_server.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

class Rights : public testing::Test {
 protected:
  static constexpr const char* kHere = "127.0.0.1";
  static Caller from(const std::string& peer_ip, const std::string& token = "") {
    return {.peer_ip = peer_ip,
            .own_ip = peer_ip == kHere ? kHere : "10.0.0.1",
            .host = "127.0.0.1:8080",
            .authorization = token.empty() ? "" : "Bearer " + token};
  }
  /// 200 when it may.
  static int status(Gate& gate, const Caller& caller, Access needed) {
    const auto answer = gate.check(caller, needed);
    const auto* refused = std::get_if<Refused>(&answer);
    return refused == nullptr ? 200 : refused->status;
  }
  void configure(const std::string& toml) { write_file_atomically(farm_config_file(folder_.path()), toml); }
  static std::string entry(const std::string& name, const std::string& role, const std::string& token) {
    return "[[token]]\nname = \"" + name + "\"\nrole = \"" + role + "\"\nsha256 = \"" + sha256_hex(token) + "\"\n";
  }
  TemporaryFolder folder_;
};

TEST_F(Rights, ReadsAreFreeOnThisMachineAndNeedATokenFromElsewhere) {
  Gate gate(folder_.path(), "127.0.0.1");
  EXPECT_EQ(status(gate, from(kHere), Access::Read), 200);
  EXPECT_EQ(status(gate, from("10.0.0.9"), Access::Read), 401);
  EXPECT_EQ(status(gate, from("10.0.0.9"), Access::Open), 200);
  EXPECT_EQ(status(gate, from("10.0.0.9", gate.operator_token()), Access::Read), 200);
}

TEST_F(Rights, WhatComesThroughAProxyIsNotFromThisMachine) {
  Gate gate(folder_.path(), "127.0.0.1");
  Caller caller = from(kHere);
  caller.forwarded = true;
  EXPECT_EQ(status(gate, caller, Access::Read), 401);
}

TEST_F(Rights, WritesNeedATokenThatMayOperateAlsoOnThisMachine) {
  configure(entry("wall", "read", "look") + entry("ada", "operate", "turn"));
  Gate gate(folder_.path(), "127.0.0.1");
  EXPECT_EQ(status(gate, from(kHere), Access::Operate), 401);
  EXPECT_EQ(status(gate, from(kHere, "wrong"), Access::Operate), 401);
  EXPECT_EQ(status(gate, from(kHere, "wrong"), Access::Read), 401) << "a wrong token is never overlooked";
  EXPECT_EQ(status(gate, from(kHere, "look"), Access::Operate), 403);
  EXPECT_EQ(status(gate, from("10.0.0.9", "look"), Access::Read), 200);
  const auto pass = gate.check(from("10.0.0.9", "turn"), Access::Operate);
  ASSERT_TRUE(std::holds_alternative<Pass>(pass));
  EXPECT_EQ(std::get<Pass>(pass).who, "ada");
}

TEST_F(Rights, OtherSchemesAreNotTokens) {
  Gate gate(folder_.path(), "127.0.0.1");
  Caller caller = from(kHere);
  for (const std::string text : {"Basic abc", gate.operator_token().c_str(), "bearer", "Bearer", "Bearer "}) {
    caller.authorization = text;
    EXPECT_EQ(status(gate, caller, Access::Operate), 401) << text;
  }
}

TEST_F(Rights, TheOperatorsTokenIsMadeOnceForItsOwnerAlone) {
  const std::string first = Gate(folder_.path(), "").operator_token();
  EXPECT_EQ(first.size(), 64u);
  EXPECT_EQ(Gate(folder_.path(), "").operator_token(), first);
  const fs::path file = operator_token_file(folder_.path());
  EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  fs::permissions(file, fs::perms::group_read, fs::perm_options::add);
  try {
    Gate(folder_.path(), "");
    FAIL() << "others could read it";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("chmod 600"), std::string::npos) << e.what();
  }
}

TEST_F(Rights, TokensOfTheConfigurationReplaceTheOperatorsAndMayChangeWhileItRuns) {
  Gate gate(folder_.path(), "127.0.0.1");
  const std::string first = gate.operator_token();
  EXPECT_EQ(status(gate, from(kHere, first), Access::Operate), 200);
  configure(entry("ada", "operate", "turn"));
  EXPECT_EQ(status(gate, from(kHere, "turn"), Access::Operate), 200);
  EXPECT_EQ(status(gate, from(kHere, first), Access::Operate), 401);
  configure("[[token]]\nname = 3\n");
  fs::last_write_time(farm_config_file(folder_.path()), fs::file_time_type::clock::now() + std::chrono::seconds(9));
  EXPECT_EQ(status(gate, from(kHere, "turn"), Access::Operate), 200) << "a broken file changes nothing";
}

TEST_F(Rights, ANameThatSomebodyLetsPointHereGetsNothing) {
  Gate gate(folder_.path(), "farm.local");
  Caller caller = from(kHere);
  for (const char* good : {"localhost", "localhost:8080", "127.0.0.1:1", "[::1]:8080", "farm.local:8080"}) {
    caller.host = good;
    EXPECT_EQ(status(gate, caller, Access::Read), 200) << good;
  }
  for (const char* bad : {"evil.example", "evil.example:8080", "127.0.0.1.evil.example", "localhost.evil.example"}) {
    caller.host = bad;
    EXPECT_EQ(status(gate, caller, Access::Open), 421) << bad;
  }
}

TEST_F(Rights, ASessionReadsButNeverWrites) {
  Gate gate(folder_.path(), "127.0.0.1");
  Caller caller = from("10.0.0.9");
  caller.session = gate.open_session({"ada", Access::Operate});
  EXPECT_EQ(status(gate, caller, Access::Read), 200);
  EXPECT_EQ(status(gate, caller, Access::Operate), 401);
  caller.session = "guessed";
  EXPECT_EQ(status(gate, caller, Access::Read), 401);
}

class Guarded : public ApiServer {};

TEST_F(Guarded, NothingChangesWithoutAToken) {
  for (const char* path :
       {"/api/v1/shots", "/api/v1/shots/1/cancel", "/api/v1/jobs/6/retry", "/api/v1/workers/w1/drain"}) {
    const auto answer = http_.Post(path, R"({"folder": "/x"})", "application/json");
    EXPECT_EQ(answer->status, 401) << path;
    EXPECT_EQ(answer->get_header_value("WWW-Authenticate"), "Bearer realm=\"vantage\"");
    EXPECT_NE(Json::parse(answer->body).at("error").get<std::string>().find("operator.token"), std::string::npos);
  }
  EXPECT_FALSE(command_ || submitted_);
}

TEST_F(Guarded, ABrowserChangesItsTokenForACookieThatShowsPictures) {
  const httplib::Headers far{{"X-Forwarded-For", "203.0.113.7"}};
  EXPECT_EQ(http_.Get("/api/v1/jobs/4/preview", far)->status, 401);
  httplib::Headers with_token = far;
  with_token.emplace("Authorization", "Bearer " + token_);
  const auto opened = http_.Post("/api/v1/session", with_token, "", "application/json");
  ASSERT_EQ(opened->status, 200) << opened->body;
  const std::string cookie = opened->get_header_value("Set-Cookie");
  EXPECT_NE(cookie.find("HttpOnly; SameSite=Strict"), std::string::npos);
  httplib::Headers with_cookie = far;
  with_cookie.emplace("Cookie", "other=1; " + cookie.substr(0, cookie.find(';')));
  EXPECT_EQ(http_.Get("/api/v1/jobs/4/preview", with_cookie)->status, 200);
  EXPECT_EQ(http_.Post("/api/v1/jobs/6/retry", with_cookie, "", "application/json")->status, 401);
  EXPECT_FALSE(command_);
}

TEST_F(Guarded, ThePageNeedsNoTokenAndItsAddressCarriesOne) {
  EXPECT_EQ(http_.Get("/", {{"X-Forwarded-For", "203.0.113.7"}})->status, 200);
  EXPECT_EQ(server_.page_url(), server_.url() + "/#token=" + token_);
}

}  // namespace
}  // namespace vantage
