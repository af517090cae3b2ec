#include "scheduler/cli/report_keeper.h"

#include <fmt/format.h>

#include <algorithm>

#include "scheduler/api/queries.h"

namespace vantage {
namespace {

constexpr std::int64_t kRefreshMs = 20'000;
/// A big shot's report takes a while: at most this share of the time goes into it.
constexpr std::int64_t kCostFactor = 50;

}  // namespace

std::vector<std::string> ReportKeeper::keep(const std::vector<ShotProgress>& shots) {
  std::vector<std::string> sentences;
  for (const auto& shot : shots) {
    const bool is_new = !written_.contains(shot.shot.value);
    Written& written = written_[shot.shot.value];
    if (is_new) written.next_ms = clock_.monotonic_ms() + kRefreshMs;
    const bool ended = shot.finished() && written.generation != shot.generation;
    const bool stale =
        !shot.finished() && clock_.monotonic_ms() >= written.next_ms && written.num_finished != shot.num_finished();
    if (!ended && !stale) continue;
    if (shot.finished()) written.generation = shot.generation;
    written.next_ms = clock_.monotonic_ms() + kRefreshMs;  // also when it fails: one complaint per try, few tries
    try {
      write(shot, written);
    } catch (const Error& e) {
      sentences.push_back(fmt::format("the report was not written: {}", e.what()));
    }
  }
  return sentences;
}

void ReportKeeper::write(const ShotProgress& shot, Written& written) {
  const std::int64_t start_ms = clock_.monotonic_ms();
  write_report(FarmQueries(state_dir_).report_input(shot.shot.value, clock_.wall_ms()));
  const std::int64_t end_ms = clock_.monotonic_ms();
  written.next_ms = end_ms + std::max(kRefreshMs, kCostFactor * (end_ms - start_ms));
  written.num_finished = shot.num_finished();
}

}  // namespace vantage
