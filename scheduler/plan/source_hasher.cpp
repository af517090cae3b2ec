#include "scheduler/plan/source_hasher.h"

#include <algorithm>
#include <utility>

#include "schema/base/error.h"
#include "schema/base/hash_watched.h"

namespace vantage {
namespace {

struct BrokenOff {};

}  // namespace

SourceHasher::SourceHasher(std::function<void()> on_done)
    : on_done_(std::move(on_done)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

SourceHasher::~SourceHasher() = default;

void SourceHasher::request(const std::filesystem::path& path, const FileStamp& stamp) {
  const std::lock_guard lock(mutex_);
  const bool known =
      reading_ == path || std::any_of(waiting_.begin(), waiting_.end(), [&](const auto& f) { return f.path == path; });
  if (known) return;
  waiting_.push_back({.path = path, .stamp = stamp, .hash = {}, .error = {}});
  changed_.notify_one();
}

std::vector<SourceHasher::Hashed> SourceHasher::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(done_, {});
}

SourceHasher::Progress SourceHasher::progress() const {
  const std::lock_guard lock(mutex_);
  return {.path = reading_, .num_bytes = num_bytes_};
}

SourceHasher::Hashed SourceHasher::read(const std::stop_token& stop, Hashed file) {
  try {
    file.hash = hash_file_watched(file.path, [&](std::uintmax_t num_bytes) {
      num_bytes_ = num_bytes;
      if (stop.stop_requested()) throw BrokenOff{};
    });
  } catch (const Error& e) {
    file.error = e.what();
  }
  return file;
}

void SourceHasher::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [&] { return !waiting_.empty(); })) {
    Hashed file = std::move(waiting_.front());
    waiting_.pop_front();
    reading_ = file.path;
    num_bytes_ = 0;
    lock.unlock();
    try {
      file = read(stop, std::move(file));
    } catch (const BrokenOff&) {
      return;
    }
    lock.lock();
    reading_.clear();
    done_.push_back(std::move(file));
    on_done_();
  }
}

}  // namespace vantage
