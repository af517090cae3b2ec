#include "scheduler/report/report.h"

#include <gtest/gtest.h>

#include "scheduler/api/queries.h"
#include "scheduler/report/html.h"
#include "scheduler/report/plot.h"
#include "schema/base/files.h"
#include "tests/scheduler/api/small_farm.h"

namespace vantage {
namespace {

class Report : public testing::Test {
 protected:
  std::string page() { return report_html(FarmQueries(farm_.state_dir()).report_input(SmallFarm::kShotId, 1'060'000)); }
  void expect_holds(const std::string& part) { EXPECT_NE(page().find(part), std::string::npos) << part; }
  SmallFarm farm_;
};

TEST_F(Report, ShowsWhatWentInAndWhatCameOut) {
  expect_holds("left.mp4");
  expect_holds("640 × 360");
  expect_holds("600.0 px");
  expect_holds("+0.0333 s");
  expect_holds("1.2 ms");
  expect_holds("4 images, 2 simplices, 5 edges");
  expect_holds("<video src=\"render/freeze/freeze.mp4\"");
}

TEST_F(Report, LinksAFilmByItsNameBelowOutThoughItLiesInTheStore) {
  const auto film = farm_.shot() / "out" / "render" / "freeze" / "freeze.mp4";
  std::filesystem::rename(film, farm_.shot() / ".vantage" / "store" / "freeze.mp4");
  std::filesystem::create_symlink("../../../.vantage/store/freeze.mp4", film);
  expect_holds("<video src=\"render/freeze/freeze.mp4\"");
}

TEST_F(Report, NamesFailedJobsWithErrorAndLogAndEscapesThem) {
  expect_holds("left-000000: no edge &lt;with&gt; depth");
  expect_holds("logs/depth.log");
  expect_holds("1 failed");
  EXPECT_EQ(page().find("<with>"), std::string::npos);
}

TEST_F(Report, CollectsWarningsOfAllJobs) {
  expect_holds("few &lt;features&gt; in calibrate");
  expect_holds("few &lt;features&gt; in ingest/right");
}

TEST_F(Report, AddsUpTimePerStage) {
  expect_holds("1:00 min");  // wall time so far
  expect_holds("12 s</b> of work");
}

TEST_F(Report, HoldsSmallPicturesItself) { expect_holds("data:image/svg+xml;base64,"); }

TEST_F(Report, SurvivesAnArtifactThatCannotBeRead) {
  write_file_atomically(farm_.shot() / ".vantage/store/navspace/f1/navspace.json", "{");
  expect_holds("Not shown: ");
  expect_holds("Clocks");
}

TEST_F(Report, IsWrittenBelowOut) {
  write_report(FarmQueries(farm_.state_dir()).report_input(SmallFarm::kShotId, 1'060'000));
  EXPECT_EQ(read_file(farm_.shot() / "out" / "report.html"), page());
}

TEST(Html, FiguresAndDurationsReadWell) {
  EXPECT_EQ(html::figure(0.432178), "0.4322");
  EXPECT_EQ(html::figure(Json{1, "a<b"}), "1, a&lt;b");
  EXPECT_EQ(html::duration(3.21), "3.2 s");
  EXPECT_EQ(html::duration(185), "3:05 min");
  EXPECT_EQ(html::duration(7325), "2:02 h");
}

TEST(Plot, EqualScaleKeepsAngles) {
  report::Plot plot({0, 10, "x"}, {0, 1, "y"}, true, 564, 348);
  plot.line(0, 0, 1, 1, "red", 1);
  const std::string svg = plot.svg();
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  ASSERT_EQ(std::sscanf(svg.c_str() + svg.rfind("<path d="), "<path d=\"M%lf %lfL%lf %lf\"", &x0, &y0, &x1, &y1), 4);
  EXPECT_NEAR(x1 - x0, y0 - y1, 0.21);
  EXPECT_GT(x1 - x0, 10);
}

TEST(Plot, ASinglePointIsAPlotToo) {
  report::Plot plot({3, 3, "x"}, {5, 5, "y"}, false);
  plot.dot(3, 5, 2, "red");
  EXPECT_EQ(plot.svg().find("nan"), std::string::npos);
}

}  // namespace
}  // namespace vantage
