#include "schema/base/program.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/program_pipe.h"

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

TEST(ProgramPipe, GivesTheOutputAsItComesAndThenTheStatus) {
  const auto err = temporary("pipe_err");
  ProgramPipe pipe({"sh", "-c", "printf abc; echo oops >&2; printf defg; exit 4"}, err);
  char bytes[5] = {};
  EXPECT_EQ(pipe.read(bytes, 5), 5U);
  EXPECT_EQ(std::string(bytes, 5), "abcde");
  EXPECT_EQ(pipe.read(bytes, 5), 2U);
  EXPECT_EQ(pipe.read(bytes, 5), 0U);
  EXPECT_EQ(pipe.wait(), 4);
  EXPECT_EQ(read_file(err), "oops\n");
  std::filesystem::remove(err);
}

TEST(ProgramPipe, EndsAProgramThatNobodyReadsAnyMore) {
  const auto err = temporary("pipe_err");
  const auto start = std::chrono::steady_clock::now();
  { ProgramPipe pipe({"sleep", "60"}, err); }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(30));
  std::filesystem::remove(err);
}

}  // namespace
}  // namespace vantage
