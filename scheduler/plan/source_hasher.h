#pragma once
#include <atomic>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "scheduler/store/rows.h"

namespace vantage {

/// Reads footage to know its content on a thread of its own: at some 300 MB/s a long film takes minutes, in which the
/// farm must go on. One file at a time, in the order in which they were asked for.
class SourceHasher {
 public:
  struct Hashed {
    std::filesystem::path path;
    FileStamp stamp;    ///< of the file when it was asked for
    std::string hash;   ///< empty: it could not be read
    std::string error;  ///< why
  };
  /// on_done: called on the thread after each file.
  explicit SourceHasher(std::function<void()> on_done);
  /// Breaks off what is not read yet.
  ~SourceHasher();
  SourceHasher(const SourceHasher&) = delete;
  SourceHasher& operator=(const SourceHasher&) = delete;

  /// Nothing when the file waits or is being read already.
  void request(const std::filesystem::path& path, const FileStamp& stamp);
  std::vector<Hashed> take();
  /// How much of the file that is being read now; its path is empty when there is none.
  struct Progress {
    std::filesystem::path path;
    std::uintmax_t num_bytes = 0;
  };
  Progress progress() const;

 private:
  void run(const std::stop_token& stop);
  Hashed read(const std::stop_token& stop, Hashed file);

  std::function<void()> on_done_;
  std::atomic<std::uintmax_t> num_bytes_ = 0;
  mutable std::mutex mutex_;  ///< guards all below
  std::condition_variable_any changed_;
  std::deque<Hashed> waiting_;
  std::filesystem::path reading_;
  std::vector<Hashed> done_;
  std::jthread thread_;
};

}  // namespace vantage
