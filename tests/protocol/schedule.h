#pragma once
/// One run of the simulated farm as a value: the same schedule gives the same run.
#include <cstdint>
#include <string>
#include <vector>

namespace vantage {

/// Chances per datagram; a delay is drawn anew for each, so that they overtake each other.
struct Weather {
  double loss = 0, duplicate = 0, corrupt = 0, replay = 0;
  std::int64_t max_delay_ms = 5;
};

/// Chances per attempt, of the job's process.
struct Fates {
  double crash = 0, fail = 0, hang = 0;
  double dies_after_commit = 0;  ///< its result is in the store, its worker never hears of it
  double late_storage = 0;       ///< reported done before the scheduler's storage shows it
};

enum class FaultKind {
  KillScheduler,  ///< at a moment that `choice` picks; comes up again after for_ms
  KillWorker,     ///< likewise, with its jobs
  StallScheduler,
  StallWorker,   ///< SIGSTOP: its jobs go on, it hears and says nothing for for_ms
  CutWorkerOff,  ///< no datagram from or to it for for_ms
  Drain,
  Undrain,
  PauseShot,
  ResumeShot,
  CancelJob,
  RetryShot,
  PauseJob,
  ResumeJob,
  RetryJob,
  Resubmit,
  ForgeReport,   ///< well signed, of a job that is out, with a token that nobody gave
  ForgeForeign,  ///< of another farm, and with a bad signature
};
inline constexpr int kNumFaultKinds = 17;
const char* to_string(FaultKind kind);

struct Fault {
  std::int64_t at_ms = 0;
  FaultKind kind = FaultKind::KillWorker;
  std::uint64_t choice = 0;  ///< which worker, job or moment
  std::int64_t for_ms = 0;
};

struct Schedule {
  std::uint64_t seed = 0;  ///< of everything that is not said below
  int num_workers = 1, num_slots = 1, num_edges = 1, num_noops = 0, lease_ms = 3000;
  std::int64_t faulty_ms = 10'000;  ///< then the weather is calm and nothing fails any more
  bool last_is_lost = false;        ///< the last worker ends with the faults and never comes back
  Weather weather;
  Fates fates;
  std::vector<Fault> faults;
};

Schedule random_schedule(std::uint64_t seed);
/// For people: the whole schedule in a few lines.
std::string to_text(const Schedule& schedule);

/// Numbers that depend on the seed and on what they are for only, not on what was drawn before: a schedule with one
/// fault less still meets the same chances.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : seed_(seed) {}
  std::uint64_t bits(const char* what, std::uint64_t a, std::uint64_t b = 0) const;
  bool chance(double probability, const char* what, std::uint64_t a, std::uint64_t b = 0) const;
  /// In [low, high].
  std::int64_t between(std::int64_t low, std::int64_t high, const char* what, std::uint64_t a,
                       std::uint64_t b = 0) const;

 private:
  std::uint64_t seed_;
};

}  // namespace vantage
