// The page in a real browser, against a real server and a database made by hand.
#include <gtest/gtest.h>

#include <cstdio>

#include "scheduler/api/http_server.h"
#include "schema/base/files.h"
#include "tests/scheduler/api/small_farm.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

class Page : public testing::Test {
 protected:
  Page()
      : server_({.listen = "127.0.0.1:0",
                 .state_dir = farm_.state_dir(),
                 .control = {.submit = {}, .command = {}, .state = [] { return FarmState{}; }}}) {}

  /// The page's elements once its scripts have run for a while of the browser's own time, which stands still while
  /// answers are awaited.
  std::string elements(const std::string& address) { return browse("--dump-dom", address); }
  fs::path screenshot(const std::string& address) {
    const fs::path file = profile_.path() / "page.png";
    browse("--screenshot=" + file.string() + " --window-size=1500,1300", address);
    return file;
  }
  std::string operator_address(const std::string& rest) const { return server_.page_url() + "&still=1&" + rest; }
  std::string address(const std::string& rest = "") const { return server_.url() + "/#still=1&" + rest; }

 private:
  std::string browse(const std::string& what, const std::string& address) const {
    const std::string command =
        std::string(CHROMIUM) +
        " --headless --no-sandbox --disable-gpu --hide-scrollbars --disable-dev-shm-usage --user-data-dir=" +
        profile_.path().string() + " --virtual-time-budget=5000 " + what + " '" + address + "' 2>/dev/null";
    FILE* pipe = popen(command.c_str(), "r");
    std::string output;
    char buffer[4096];
    for (std::size_t n = 0; (n = fread(buffer, 1, sizeof buffer, pipe)) > 0;) output.append(buffer, n);
    EXPECT_EQ(pclose(pipe), 0) << command;
    return output;
  }

  SmallFarm farm_;
  TemporaryFolder profile_;
  HttpServer server_;
};

void expect_holds(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << part;
}

TEST_F(Page, ShowsStagesJobsPicturesAndWorkers) {
  const std::string page = elements(address());
  for (const char* stage : {"ingest", "calibrate", "track", "sync", "align", "navspace", "correspond", "depth",
                            "render", "encode", "reconstruct", "fuse"})
    expect_holds(page, std::string("<span class=\"name\">") + stage + "</span>");
  expect_holds(page, "correspond/left-000000__left-000001");
  expect_holds(page, "left-000000: no edge &lt;with&gt; depth");
  expect_holds(page, "/api/v1/jobs/4/preview");
  expect_holds(page, "<strong>studio</strong>");
  expect_holds(page, "6 of 14 jobs");
}

TEST_F(Page, OpensAJobFromItsAddress) {
  const std::string page = elements(address("job=6"));
  expect_holds(page, "no edge with depth");
  expect_holds(page, "crashed");
}

TEST_F(Page, FiltersByStageFromItsAddress) {
  const std::string page = elements(address("kind=render"));
  expect_holds(page, "<td class=\"mono\">render/freeze/000005</td>");
  EXPECT_EQ(page.find("<td class=\"mono\">calibrate</td>"), std::string::npos);
}

TEST_F(Page, OnlyReadsWithoutAToken) {
  const std::string page = elements(address());
  expect_holds(page, "Read only");
  EXPECT_EQ(page.find(">Retry failed</button>"), std::string::npos);
}

TEST_F(Page, OffersOrdersToWhoHasAToken) {
  const std::string page = elements(operator_address("job=6"));
  expect_holds(page, "operator</span>");
  expect_holds(page, ">Retry failed</button>");
  expect_holds(page, ">Retry</button>");
  expect_holds(page, ">Drain</button>");
}

TEST_F(Page, DrawsAPicture) { EXPECT_GT(fs::file_size(screenshot(address())), 30'000u); }

}  // namespace
}  // namespace vantage
