#pragma once
/// What a child process tells its worker, by files in the attempt's folder: no pipe that somebody has to drain.
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "schema/messages/protocol.h"

namespace vantage {

/// WORKER_STATE/attempts/<job>.<number>/: outcome.json, progress.json, scratch/
struct AttemptFiles {
  std::filesystem::path folder;
  std::filesystem::path outcome() const { return folder / "outcome.json"; }
  std::filesystem::path progress() const { return folder / "progress.json"; }
  std::filesystem::path scratch() const { return folder / "scratch"; }
};

struct Progress {
  double fraction = 0;
  std::string phase;
};

/// Child: at most five times a second, whatever the job does.
class ProgressWriter {
 public:
  explicit ProgressWriter(std::filesystem::path file) : file_(std::move(file)) {}
  void write(double fraction, const std::string& phase);

 private:
  std::filesystem::path file_;
  std::chrono::steady_clock::time_point next_{};
};

/// Worker: the last progress written; empty when there is none yet.
std::optional<Progress> read_progress(const std::filesystem::path& file);

/// The child's own view of its end: outcome is Done or Failed.
void write_outcome(const std::filesystem::path& file, const DoneAttempt& outcome);
/// Empty when the child did not get to write it: it crashed or was killed.
std::optional<DoneAttempt> read_outcome(const std::filesystem::path& file);

/// One line of at most 300 bytes, cut between characters of UTF-8.
std::string one_line(const std::string& text);

}  // namespace vantage
