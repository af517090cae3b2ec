#pragma once
/// STATE/turn.lock: lets another process wait until the scheduler has written down what it saw in the store. A turn of
/// the scheduler looks for an artifact and then commits that its job is done; who moves artifacts away must not do it
/// for good between the two.
#include <filesystem>

namespace vantage {

class TurnLock {
 public:
  /// Makes the file when it is missing. Throws Error(Resource) when that cannot be.
  explicit TurnLock(const std::filesystem::path& state_dir);
  ~TurnLock();
  TurnLock(const TurnLock&) = delete;
  TurnLock& operator=(const TurnLock&) = delete;

  /// While it lives, a turn goes on. The scheduler's thread.
  class Turn {
   public:
    explicit Turn(const TurnLock& lock);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    int fd_;
  };
  Turn turn() const { return Turn(*this); }

  /// Returns when every turn that had begun is over; at once when no scheduler runs. Any other process.
  void wait_for_turns_to_end() const;

 private:
  int fd_ = -1;
};

}  // namespace vantage
