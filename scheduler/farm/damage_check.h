#pragma once
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

namespace vantage {

/// Looks through the whole database once, beside the farm that works on it: at a million jobs that takes longer than a
/// start may. What the start itself checks is in migrations.cpp.
class DamageCheck {
 public:
  /// Starts a thread with a read-only connection of its own.
  explicit DamageCheck(std::filesystem::path state_dir);
  /// Gives up what is not looked at yet.
  ~DamageCheck();
  DamageCheck(const DamageCheck&) = delete;
  DamageCheck& operator=(const DamageCheck&) = delete;
  /// One line on what is wrong; empty while nothing is known to be.
  std::string verdict() const;

 private:
  void look(const std::stop_token& stop);
  std::filesystem::path state_dir_;
  mutable std::mutex mutex_;
  std::string verdict_;
  std::jthread thread_;
};

}  // namespace vantage
