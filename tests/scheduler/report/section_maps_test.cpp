#include <gtest/gtest.h>

#include "scheduler/report/report.h"
#include "schema/base/files.h"
#include "schema/formats/manifest.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

namespace fs = std::filesystem;

class SectionMaps : public testing::Test {
 protected:
  SectionMaps() { input_.shot.folder = folder_.path(); }

  void add(const std::string& name, const Json& figures) {
    const fs::path artifact = folder_.path() / std::to_string(input_.jobs.size());
    fs::create_directories(artifact);
    write_file_atomically(artifact / "preview.svg", "<svg/>");
    const auto files = list_artifact_files(artifact);
    write_manifest(artifact, {.kind = name.substr(0, name.find('/')),
                              .version = 1,
                              .job = name,
                              .key = "k",
                              .content = content_hash(files),
                              .files = files,
                              .figures = figures,
                              .provenance = Json::object()});
    input_.jobs.push_back({.name = name,
                           .kind = name.substr(0, name.find('/')),
                           .state = "done",
                           .artifact = artifact,
                           .error_kind = "",
                           .error = "",
                           .log_path = ""});
  }
  bool page_holds(const std::string& part) const { return report_html(input_).find(part) != std::string::npos; }

  TemporaryFolder folder_;
  ReportInput input_;
};

TEST_F(SectionMaps, EdgesAreCountedByCamerasAndTheLowestOnesAreShown) {
  add("correspond/b-000000__a-000001", {{"consistent_percent", 81.25}, {"epipolar_residual_median_px", 0.125}});
  add("correspond/a-000001__b-000002", {{"consistent_percent", 62.5}, {"epipolar_residual_median_px", 0.375}});
  add("correspond/a-000000__b-000000", {{"consistent_percent", 91.5}, {"epipolar_residual_median_px", 0.25}});
  add("correspond/a-000000__a-000001", {{"consistent_percent", 99.5}});
  EXPECT_TRUE(page_holds("<td>a – b</td><td>3</td><td>62.5 %</td><td>81.2 %</td><td>0.250 px</td>"));
  EXPECT_TRUE(page_holds("<td>a, in time</td><td>1</td><td>99.5 %</td><td>99.5 %</td><td></td>"));
  EXPECT_TRUE(page_holds("a-000001__b-000002: consistent 62.5 % (lowest)"));
  EXPECT_TRUE(page_holds("b-000000__a-000001: consistent 81.2 % (middle)"));
  EXPECT_FALSE(page_holds("a-000000__b-000000: consistent"));
}

TEST_F(SectionMaps, DepthIsToldByCamera) {
  add("depth/a-000000", {{"known_percent", 95.5}, {"agreed_percent", 90.5}});
  add("depth/a-000001", {{"known_percent", 85.5}, {"agreed_percent", 80.5}});
  add("depth/a-000002", {{"known_percent", 90.5}, {"agreed_percent", 85.5}});
  EXPECT_TRUE(page_holds("<td>a</td><td>3</td><td>85.5 %</td><td>90.5 %</td><td>85.5 %</td>"));
  EXPECT_TRUE(page_holds("a-000001: known 85.5 % (lowest)"));
}

TEST_F(SectionMaps, FramesAreToldByRenderAndShowTheirDepthBudget) {
  add("render/pan/000000", {{"holes_percent", 0.5}, {"images", 12}});
  add("render/pan/000001", {{"holes_percent", 4.5}, {"images", 12}});
  add("render/eyes/000000", {{"holes_percent", 1.5}, {"images", 8}});
  add("encode/eyes", {{"frames", 1}});
  write_file_atomically(input_.jobs.back().artifact / "depth_budget.png", "picture");
  EXPECT_TRUE(page_holds("<td>pan</td><td>2</td><td>95.5 %</td>"));
  EXPECT_TRUE(page_holds("pan/000001: seen 95.5 % (lowest)"));
  EXPECT_TRUE(page_holds("eyes: depth budget"));
  EXPECT_FALSE(page_holds("pan: depth budget"));
}

}  // namespace
}  // namespace vantage
