/// Planner: footage that has to be read before the jobs that read it can be named.
#include <fmt/format.h>

#include "scheduler/plan/footage_unread.h"
#include "scheduler/plan/planner.h"
#include "schema/base/error.h"
#include "schema/base/hash.h"

namespace vantage {
namespace {

/// Read at once: no slower than the rows that are written about it.
constexpr std::int64_t kAtOnceBytes = 8 << 20;

std::string reading_text(const std::filesystem::path& path, std::uintmax_t num_read, std::int64_t size) {
  return fmt::format("reading footage {}: {:.1f} of {:.1f} GB", path.filename().string(),
                     static_cast<double>(num_read) / 1e9, static_cast<double>(size) / 1e9);
}

}  // namespace

std::string Planner::source_hash(const std::filesystem::path& path) {
  const FileStamp stamp = Store::stamp_of(path);
  std::string hash = store_.known_source_hash(path, stamp);
  if (!hash.empty()) return hash;
  if (hasher_ != nullptr && stamp.size > kAtOnceBytes) {
    hasher_->request(path, stamp);
    throw FootageUnread(path);
  }
  hash = hash_file(path);
  store_.set_source_hash(path, stamp, hash);
  return hash;
}

/// What runs goes on: whether its footage has changed is not known yet.
void Planner::wait_for_footage(const JobRow& job, const std::filesystem::path& path) {
  wait_for_footage_[path].insert(job.id);
  if (is_active(job.state)) return;
  block(job.id, job.state, "");
  store_.set_reason(job.id, reading_text(path, 0, Store::stamp_of(path).size));
}

void Planner::go_on_with_footage() {
  if (hasher_ == nullptr || wait_for_footage_.empty()) return;
  for (const SourceHasher::Hashed& file : hasher_->take()) {
    if (!file.hash.empty()) store_.set_source_hash(file.path, file.stamp, file.hash);
    const auto waiting = wait_for_footage_.extract(file.path);
    if (!waiting) continue;
    for (const JobId id : waiting.mapped()) {
      const JobRow job = *store_.job(id);
      if (job.num_unmet > 0 || (job.state != JobState::Blocked && !is_active(job.state))) continue;
      if (file.error.empty()) {
        settle(job);
      } else {
        revoke(id);
        store_.set_error(id, std::string(to_string(ErrorKind::Transient)), file.error);
        move(id, JobState::Failed, file.error);
      }
      if (is_finished(store_.brief(id)->state)) finished(id);
    }
  }
  const auto progress = hasher_->progress();
  const auto reading = wait_for_footage_.find(progress.path);
  std::error_code gone;
  const auto size = std::filesystem::file_size(progress.path, gone);
  if (reading == wait_for_footage_.end() || gone) return;
  const std::string text = reading_text(progress.path, progress.num_bytes, static_cast<std::int64_t>(size));
  for (const JobId id : reading->second) {
    const auto job = store_.brief(id);
    if (job->state == JobState::Blocked) store_.set_reason(id, text);
    effects_.changed.insert(job->shot);
  }
}

}  // namespace vantage
