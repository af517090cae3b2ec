#include "worker/run_table.h"

#include <gtest/gtest.h>

#include "schema/base/error.h"

namespace vantage {
namespace {

RunTable table() {
  return {{.spec = {.name = "depth", .version = 2, .reads = "", .publishes = "maps", .programs = "sh"}, .run = {}},
          {.spec = {.name = "calibrate", .version = 1, .reads = "", .publishes = "", .programs = "sh no-such-program"},
           .run = {}}};
}

TEST(RunTable, KindThatLacksAProgramIsNotOfferedAndSaidSo) {
  const Capabilities can = capabilities_of(table());
  EXPECT_EQ(can.kinds, std::vector<std::string>{"depth/2"});
  ASSERT_EQ(can.missing.size(), 1U);
  EXPECT_EQ(can.missing[0], "calibrate needs the program 'no-such-program', which is not on PATH");
}

TEST(RunTable, OtherVersionIsForAnotherWorkerAndUnknownKindIsAMistake) {
  EXPECT_EQ(find_run(table(), "depth", 2).spec.publishes, "maps");
  try {
    find_run(table(), "depth", 3);
    FAIL() << "found";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Transient);
  }
  try {
    find_run(table(), "dept", 1);
    FAIL() << "found";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::BadInput);
    EXPECT_NE(std::string(e.what()).find("depth"), std::string::npos);
  }
}

}  // namespace
}  // namespace vantage
