#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "schema/base/error.h"
#include "tests/support/short_jobs/short_jobs.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

constexpr std::size_t kMiB = 1 << 20;

[[noreturn]] void stay_busy() {
  volatile bool for_ever = true;  // a loop without effect may not be there at all
  while (for_ever) continue;
  std::abort();
}

[[noreturn]] void hang() {
  for (;;) pause();
}

void hog(JobContext& context, std::size_t num_mb) {
  std::vector<std::string> blocks;
  for (std::size_t i = 0; i < num_mb; i += 16) {
    blocks.emplace_back(16 * kMiB, 'x');
    context.progress(static_cast<double>(i) / static_cast<double>(num_mb), "taking memory");
  }
  std::this_thread::sleep_for(std::chrono::seconds(2));  // long enough to be seen
}

void chatter(std::size_t num_mb) {
  const std::string line = std::string(1023, 'c') + "\n";
  std::string block;
  while (block.size() < kMiB) block += line;
  for (std::size_t i = 0; i < num_mb; ++i) fmt::print(stderr, "{}", block);
}

/// Counts in a file, since nothing else of an attempt outlives it.
void fail_at_first(const fs::path& memory, int num_failures) {
  std::ofstream(memory, std::ios::app) << 'x';
  if (fs::file_size(memory) <= static_cast<std::uintmax_t>(num_failures))
    throw Error(ErrorKind::Transient, fmt::format("failure {} of {}", fs::file_size(memory), num_failures));
}

}  // namespace

void TroubleJob::run(JobContext& context, const Params&) {
  const Json& unit = context.unit();
  const std::string sort = unit.at("sort");
  const int amount = unit.at("amount");
  if (sort == "crash") std::abort();
  if (sort == "hang") hang();
  if (sort == "busy") stay_busy();
  if (sort == "bad") throw Error(ErrorKind::BadInput, "this input is bad, and will be tomorrow");
  if (sort == "hog") hog(context, static_cast<std::size_t>(amount));
  if (sort == "chatter") chatter(static_cast<std::size_t>(amount));
  if (sort == "slow") std::this_thread::sleep_for(std::chrono::milliseconds(amount));
  if (sort == "flaky")
    fail_at_first(fs::path(unit.at("memory_dir").get<std::string>()) / unit.at("index").dump(), amount);
  std::ofstream(context.out("bytes")) << unit.at("index").dump();
}

}  // namespace vantage
