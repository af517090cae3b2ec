#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "schema/base/clock.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "schema/base/program.h"
#include "tests/support/short_jobs/short_jobs.h"

namespace vantage {
namespace {

/// num_bytes that follow from the text alone.
std::string bytes_of(const std::string& text, int num_bytes) {
  std::string bytes, block = text;
  while (std::ssize(bytes) < num_bytes) bytes += block = hash_bytes(block);
  bytes.resize(static_cast<std::size_t>(num_bytes));
  return bytes;
}

/// Tests see by it what was computed, and when: a line per run in the file that the environment names.
void note_in_journal(const char* kind, const JobContext& context) {
  const char* journal = std::getenv("VANTAGE_SHORT_JOURNAL");
  if (journal == nullptr) return;
  const std::string line =
      fmt::format("{}/{:05} {}\n", kind, context.unit().at("index").get<int>(), system_clock().wall_ms());
  std::ofstream(journal, std::ios::app) << line << std::flush;
}

void pause(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

/// Without fsync: the commit does that.
void write_bytes(JobContext& context, const std::string& bytes) {
  std::ofstream out(context.out("bytes"), std::ios::binary);
  out << bytes;
  out.close();
  if (!out) throw Error(ErrorKind::Resource, context.out("bytes").string() + ": cannot be written");
}

std::string all_inputs(const JobContext& context) {
  std::string all;
  for (const auto& [name, folder] : context.inputs())
    all += name + "=" + hash_bytes(read_file(folder / "bytes")) + "\n";
  return all;
}

}  // namespace

void SeedJob::run(JobContext& context, const Params& params) {
  note_in_journal("seed", context);
  pause(params.pause_ms);
  write_bytes(context, bytes_of(params.salt + context.unit().at("index").dump(), params.num_bytes));
}

void MixJob::run(JobContext& context, const Params& params) {
  note_in_journal("mix", context);
  pause(params.pause_ms);
  write_bytes(context, bytes_of(all_inputs(context), 200));
}

void JoinJob::run(JobContext& context, const Params&) {
  note_in_journal("join", context);
  write_bytes(context, bytes_of(all_inputs(context), 200));
}

void BlipJob::run(JobContext&, const Params&) {}

void ToolJob::run(JobContext& context, const Params&) {
  if (const int status = run_program({"vantage-short-tool"}, {}); status != 0)
    throw Error(ErrorKind::Bug, fmt::format("vantage-short-tool ended with status {}", status));
  write_bytes(context, bytes_of(context.unit().dump(), 20));
}

}  // namespace vantage
