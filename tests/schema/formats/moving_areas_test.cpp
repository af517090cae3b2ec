#include "schema/formats/moving_areas.h"

#include <gtest/gtest.h>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

const MovingAreas kAreas{"left", 3, 200, 100, {{}, {{4, 10, 12}, {5, 9, 14}}, {{99, 0, 200}}}};

TEST(MovingAreas, ComeBackAsWritten) {
  const TemporaryFolder folder;
  write_moving_areas(folder.path() / "moving.bin", kAreas);
  const MovingAreas back = read_moving_areas(folder.path());
  EXPECT_EQ(back.camera, "left");
  EXPECT_EQ(back.cell_px, 3);
  EXPECT_EQ(back.frames, kAreas.frames);
}

TEST(MovingAreas, EveryTruncationAndARunOutsideTheGridAreRefused) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "moving.bin";
  write_moving_areas(file, kAreas);
  const std::string whole = read_file(file);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    write_file_atomically(file, whole.substr(0, length));
    EXPECT_THROW(read_moving_areas(folder.path()), Error) << length;
  }
  MovingAreas outside = kAreas;
  outside.frames[1][0].end = 201;
  write_moving_areas(file, outside);
  EXPECT_THROW(read_moving_areas(folder.path()), Error);
}

}  // namespace
}  // namespace vantage
