#pragma once
#include <map>
#include <string>

#include "schema/base/ids.h"
#include "schema/messages/protocol.h"

namespace vantage {

/// How far a worker is trusted, judged by how its attempts end. A value; whoever holds it writes what must outlive it.
/// A job is tried once on a worker, then elsewhere. After three different jobs of a kind without a good one between,
/// the kind is not given there; after three different jobs of any kind in a row, the worker is set aside. All is
/// forgiven after five hours, or by a person.
class WorkerStanding {
 public:
  static constexpr std::int64_t kForgiveMs = 5 * 3'600'000;
  static constexpr int kMaxOfKind = 3, kMaxInRow = 3;

  struct Failure {
    std::string kind{};
    std::int64_t at_ms = 0;  ///< wall clock
    bool of_kind = true;     ///< no job of its kind has ended well since
    bool in_row = true;      ///< no job at all has
  };
  enum class Effect { None, KindStopped, SetAside };

  /// What this failure leads to, first time only.
  Effect note_failure(JobId job, const std::string& kind, std::int64_t now_ms);
  /// True when something was forgiven by it.
  bool note_success(JobId job, const std::string& kind);
  bool has_failed(JobId job, std::int64_t now_ms) const;
  bool is_stopped(const std::string& kind, std::int64_t now_ms) const;
  void forgive() { failures_.clear(); }
  void restore(JobId job, Failure failure) { failures_.insert_or_assign(job, std::move(failure)); }
  const std::map<JobId, Failure>& failures() const { return failures_; }

 private:
  static bool is_fresh(const Failure& f, std::int64_t now_ms) { return now_ms - f.at_ms < kForgiveMs; }
  std::map<JobId, Failure> failures_;  ///< the newest of each job
};

/// A crash, a hiccup or a want of resources may be the worker's fault; bad input and bugs never are.
bool may_blame_worker(const DoneAttempt& attempt);

}  // namespace vantage
