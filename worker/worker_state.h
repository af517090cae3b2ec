#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "schema/messages/protocol.h"

namespace vantage {

/// A worker's folder: who it is, and what it has finished but nobody has acknowledged. Survives restarts.
///   worker.json    {"id", "incarnation"}; locked while a worker uses the folder
///   outbox.json    done_unacked
///   attempts/      scratch of running attempts
class WorkerState {
 public:
  /// Makes the folder, a new id when there is none, and an incarnation higher than any before; clears attempts/.
  /// Throws Error(BadInput) when another worker uses the folder.
  explicit WorkerState(std::filesystem::path folder);
  ~WorkerState();
  WorkerState(const WorkerState&) = delete;
  WorkerState& operator=(const WorkerState&) = delete;

  const std::filesystem::path& folder() const { return folder_; }
  const std::string& worker_id() const { return worker_id_; }
  std::int64_t incarnation() const { return incarnation_; }

  std::vector<DoneAttempt> read_outbox() const;
  /// Survives the end of this process, not that of the machine: what was committed is found in the store.
  void write_outbox(const std::vector<DoneAttempt>& done) const;

  /// Scratch of an attempt; not made here.
  std::filesystem::path scratch_of(const AttemptRef& ref) const;

 private:
  void lock();
  void load_identity();

  std::filesystem::path folder_;
  int lock_fd_ = -1;
  std::string worker_id_;
  std::int64_t incarnation_ = 0;
};

}  // namespace vantage
