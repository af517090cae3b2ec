/// Nothing known but the footage: cameras calibrated by COLMAP, clocks found from motion.
#include <gtest/gtest.h>

#include "schema/base/json.h"
#include "schema/formats/calibration.h"
#include "schema/formats/clocks.h"
#include "tests/e2e/farm_under_test.h"
#include "tests/support/temporary_folder.h"

namespace vantage::e2e {
namespace {
namespace fs = std::filesystem;

const std::string kBin = VANTAGE_BIN;

/// What vantage-demo-shot films its cameras with, in seconds (tests/support, arc_cameras).
const std::map<std::string, double> kTrueOffset_s{
    {"cam0", 0.0}, {"cam1", 0.0196723}, {"cam2", -0.0439887}, {"cam3", 0.0590170}};

TEST(Estimated, CamerasAndClocksAreFoundFromFootageAlone) {
  const TemporaryFolder folder;
  const fs::path shot = folder.path() / "shot";
  const Ended made =
      run({kBin + "/vantage-demo-shot", shot, "--cameras", "4", "--frames", "20", "--width", "480", "--height", "270"});
  ASSERT_EQ(made.exit_code, 0) << made.output;
  edit(shot / "shot.toml", "[depth]\n\n[reconstruct]\n", "");
  const Ended ended = run({kBin + "/vantage", "run", shot, "--workers", "2", "--until", "navspace"});
  ASSERT_EQ(ended.exit_code, 0) << ended.output;

  const Calibration calibration = read_calibration(shot / "out/calibration");
  EXPECT_EQ(calibration.cameras.size(), 4U);
  EXPECT_EQ(calibration.cam_from_world.size(), 4U * 20U) << "a pose for every frame";
  const Clocks clocks = read_clocks(shot / "out");
  EXPECT_EQ(clocks.cameras.size(), 4U);
  for (const auto& clock : clocks.cameras)
    EXPECT_NEAR(clock.offset_s, kTrueOffset_s.at(clock.name), 0.2 / 30) << clock.name << ": a fifth of a frame at most";
}

}  // namespace
}  // namespace vantage::e2e
