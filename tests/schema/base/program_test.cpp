#include "schema/base/program.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace {

std::filesystem::path temporary(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) / (name + std::to_string(getpid()));
}

TEST(RunProgram, TellsTheExitStatusAndKeepsOutputsApart) {
  const auto out = temporary("program_out"), err = temporary("program_err");
  EXPECT_EQ(run_program({"sh", "-c", "echo to out; echo to err >&2; exit 3"}, {.stdout_file = out, .stderr_file = err}),
            3);
  EXPECT_EQ(read_file(out), "to out\n");
  EXPECT_EQ(read_file(err), "to err\n");
  std::filesystem::remove(out);
  std::filesystem::remove(err);
}

TEST(RunProgram, TellsADeathBySignal) { EXPECT_EQ(run_program({"sh", "-c", "kill -9 $$"}, {}), 128 + 9); }

TEST(RunProgram, DoesNotInterpretWords) {
  const auto out = temporary("program_words");
  EXPECT_EQ(run_program({"printf", "%s", "a b; $HOME *"}, {.stdout_file = out, .stderr_file = {}}), 0);
  EXPECT_EQ(read_file(out), "a b; $HOME *");
  std::filesystem::remove(out);
}

TEST(RunProgram, SaysThatAProgramIsMissing) {
  try {
    run_program({"no-such-program-anywhere"}, {});
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Resource);
    EXPECT_NE(std::string(e.what()).find("no-such-program-anywhere"), std::string::npos);
  }
}

}  // namespace
}  // namespace vantage
