#include "schema/formats/tracks.h"

#include <gtest/gtest.h>

#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace {

class TracksFormat : public testing::Test {
 protected:
  TracksFormat() : folder_(std::filesystem::path(testing::TempDir()) / ("tracks_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~TracksFormat() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path file() const { return folder_ / "tracks.bin"; }
  std::filesystem::path folder_;
};

TrackSet example() {
  TrackSet set{"left", 640, 360, {}};
  set.tracks.push_back({3, {{1.5F, 2.25F}, {1.75F, 2.5F}}, true, 7.5F, {{4, {}}}});
  for (std::size_t i = 0; i < 128; ++i) set.tracks[0].looks[0].descriptor[i] = static_cast<std::uint8_t>(2 * i);
  set.tracks.push_back({0, {{100.5F, 50.5F}}, false, 0.1F, {}});
  return set;
}

TEST_F(TracksFormat, RoundTripKeepsEveryField) {
  const TrackSet written = example();
  write_tracks(file(), written);
  const TrackSet read = read_tracks(folder_);
  EXPECT_EQ(read.camera, "left");
  EXPECT_EQ(read.width, 640);
  EXPECT_EQ(read.height, 360);
  ASSERT_EQ(read.tracks.size(), 2U);
  EXPECT_EQ(read.tracks[0].px, written.tracks[0].px);
  EXPECT_EQ(read.tracks[0].last_frame(), 4);
  EXPECT_TRUE(read.tracks[0].moving);
  EXPECT_EQ(read.tracks[0].motion_px, 7.5F);
  ASSERT_EQ(read.tracks[0].looks.size(), 1U);
  EXPECT_EQ(read.tracks[0].looks[0].frame, 4);
  EXPECT_EQ(read.tracks[0].looks[0].descriptor, written.tracks[0].looks[0].descriptor);
  EXPECT_FALSE(read.tracks[1].moving);
}

TEST_F(TracksFormat, EveryTruncationIsRefused) {
  write_tracks(file(), example());
  const std::string whole = read_file(file());
  for (std::size_t n = 0; n < whole.size(); n += 7) {
    write_file_atomically(file(), whole.substr(0, n));
    EXPECT_THROW(read_tracks(folder_), Error) << n << " bytes";
  }
}

TEST_F(TracksFormat, ForeignFileIsRefused) {
  write_file_atomically(file(), "PLY and so on, long enough to hold a header of ours");
  EXPECT_THROW(read_tracks(folder_), Error);
}

}  // namespace
}  // namespace vantage
