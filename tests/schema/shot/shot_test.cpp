#include "schema/shot/shot.h"

#include <gtest/gtest.h>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/shot/params.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

const std::vector<std::string> kSections{"sync", "depth", "render"};
const std::string kTwoCameras =
    "[[camera]]\nname = \"left\"\nfootage = \"left.mp4\"\n[[camera]]\nname = \"right\"\nfootage = "
    "\"right.mp4\"\nstart_s = 0.5\n";

Shot read_text(const std::string& text) {
  const TemporaryFolder folder;
  write_file_atomically(folder.path() / "shot.toml", text);
  return read_shot(folder.path(), kSections);
}

/// The message of the error that the text causes; "" when it is accepted.
std::string error_of(const std::string& text) {
  try {
    read_text(text);
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::BadInput);
    return e.what();
  }
  return "";
}

void expect_error(const std::string& text, const std::vector<std::string>& parts) {
  const std::string message = error_of(text);
  for (const auto& part : parts)
    EXPECT_NE(message.find(part), std::string::npos) << "message: " << message << "\nlacks: " << part;
}

TEST(Shot, ReadsCamerasSectionsAndRenders) {
  const Shot shot =
      read_text("[shot]\nname = \"party\"\n" + kTwoCameras +
                "[sync]\nmethod = \"known\"\n[[render]]\nname = \"fly\"\nmode = \"stereo\"\nbaseline = 0.065\n"
                "keyframes = [{at_s = 0, time_s = 1, azimuth_deg = -5}, {at_s = 2, time_s = 1.5, azimuth_deg = 5, "
                "elevation_deg = 3}]\n");
  EXPECT_EQ(shot.name, "party");
  ASSERT_EQ(shot.cameras.size(), 2U);
  EXPECT_EQ(shot.camera("right").start_s, 0.5);
  EXPECT_EQ(shot.text("sync", "method", "motion"), "known");
  EXPECT_EQ(shot.text("depth", "method", "fallback"), "fallback");
  ASSERT_EQ(shot.renders.size(), 1U);
  EXPECT_EQ(shot.renders[0].mode, "stereo");
  ASSERT_EQ(shot.renders[0].keyframes.size(), 2U);
  EXPECT_EQ(shot.renders[0].keyframes[1].time_s, 1.5);
  EXPECT_TRUE(shot.renders[0].options.values.contains("baseline"));
}

TEST(Shot, TomlErrorNamesLineAndColumn) { expect_error("[shot]\nname = = 3\n", {"shot.toml:2:", "TOML error"}); }
TEST(Shot, UnknownTableSuggestsTheNearOne) {
  expect_error(kTwoCameras + "[snyc]\n", {"unknown table [snyc]", "did you mean 'sync'?"});
}
TEST(Shot, UnknownCameraKeySuggestsTheNearOne) {
  expect_error("[[camera]]\nname = \"a\"\nfotage = \"x\"\n",
               {"shot.toml:3", "fotage", "did you mean 'footage'?"});
}
TEST(Shot, OneCameraIsTooFew) {
  expect_error("[[camera]]\nname = \"a\"\nfootage = \"a.mp4\"\n", {"has 1 camera", "two or more"});
}
TEST(Shot, SameNameTwiceIsRefused) {
  expect_error(kTwoCameras + "[[camera]]\nname = \"left\"\nfootage = \"x\"\n", {"'left' is there twice"});
}
TEST(Shot, NamesThatWouldBreakPathsAreRefused) {
  expect_error("[[camera]]\nname = \"../a\"\nfootage = \"x\"\n", {"only letters"});
}
TEST(Shot, RenderNeedsAPath) { expect_error(kTwoCameras + "[[render]]\nname = \"r\"\n", {"needs keyframes or views"}); }
TEST(Shot, KeyFramesMustRise) {
  expect_error(kTwoCameras + "[[render]]\nname = \"r\"\nkeyframes = [{at_s = 1}, {at_s = 1}]\n", {"rising at_s"});
}
TEST(Shot, UnknownModeIsNamed) {
  expect_error(kTwoCameras + "[[render]]\nname = \"r\"\nmode = \"sterio\"\nviews = \"v\"\n",
               {"did you mean 'stereo'?"});
}
TEST(Shot, MissingFolderIsNamed) { EXPECT_THROW(read_shot("/nowhere/shot", kSections), Error); }

struct Options {
  int size = 7;
  double ratio = 0.5;
  bool fast = false;
  std::string method = "good";
  void fields(auto&& field) {
    field("size", size, Range{1, 9}, "side");
    field("ratio", ratio, Range{0, 1}, "share");
    field("fast", fast, Any{}, "hurry");
    field("method", method, OneOf{{"good", "plain"}}, "how");
  }
};

Section section_of(std::map<std::string, LocatedValue> values) {
  return {.file = "shot.toml", .name = "sync", .line = 3, .values = std::move(values)};
}

TEST(Params, RoundTripThroughJson) {
  Options options;
  options.size = 4;
  options.method = "plain";
  EXPECT_EQ(params_to_json(params_from_json<Options>(params_to_json(options))), params_to_json(options));
}

TEST(Params, MessagesSayWhereFoundAndExpected) {
  const auto message = [](std::map<std::string, LocatedValue> values) -> std::string {
    try {
      params_from_section<Options>(section_of(std::move(values)));
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(message({{"size", {99, 5}}}), "shot.toml:5: [sync] size: is 99, expected 1 to 9");
  EXPECT_EQ(message({{"size", {"big", 5}}}), "shot.toml:5: [sync] size: is \"big\", expected a whole number");
  EXPECT_EQ(message({{"method", {"plane", 6}}}),
            "shot.toml:6: [sync] method: is \"plane\", expected one of good, plain (did you mean 'plain'?)");
  EXPECT_EQ(message({{"sise", {1, 7}}}), "shot.toml:7: [sync] sise: unknown key (did you mean 'size'?)");
  EXPECT_EQ(message({{"ratio", {1, 7}}}), "");
}

TEST(Params, DescribeThemselves) {
  const auto docs = describe_params<Options>();
  ASSERT_EQ(docs.size(), 4U);
  EXPECT_EQ(docs[0].allowed, "1 to 9");
  EXPECT_EQ(docs[3].default_value, "good");
}

}  // namespace
}  // namespace vantage
