#pragma once
/// What must hold at every moment of every schedule. Looks at the database through a connection of its own, which sees
/// only what was committed, and at everything that the scheduler says.
#include <map>
#include <set>
#include <string>

#include "scheduler/store/sqlite.h"
#include "schema/messages/protocol.h"
#include "tests/protocol/sim_worker.h"

namespace vantage {

/// Every member throws Violation.
class Checks {
 public:
  Checks(const std::filesystem::path& database, std::filesystem::path store, const Ledger& ledger);

  /// After every commit, before anybody else does anything.
  void after_commit();
  /// Before orders leave the scheduler.
  void on_orders(const WorkerOrders& orders);
  /// After all orders of a turn: no job is in two workers' newest orders.
  void after_flush();
  void scheduler_died() { newest_.clear(); }
  /// A worker stops an attempt: somebody must have wanted that.
  void on_stop(const AttemptRef& ref) const;
  /// When all is over: every job has its result and nothing is out.
  void at_the_end();
  /// The jobs that are not good, for people.
  std::string what_is_open();

 private:
  void counts_are_right();
  void active_jobs_have_one_open_attempt();
  void good_jobs_stay_good();
  void new_attempts_are_needed();
  void ends_were_real();
  void note_ends();
  void check_result(const std::string& kind, const std::string& key, const std::string& content);
  [[noreturn]] static void fail(const std::string& what) { throw Violation(what); }

  Sqlite db_;
  std::filesystem::path store_;
  const Ledger& ledger_;
  std::int64_t version_ = -1, last_attempt_ = 0, num_jobs_ = 0;
  std::map<std::int64_t, std::pair<std::string, std::string>> good_;  ///< key and content by job
  std::set<std::string> results_;                                     ///< keys whose manifest was looked at
  std::set<std::int64_t> tokens_;
  std::set<AttemptRef> ended_;                                        ///< in some commit, even if taken back since
  std::set<std::pair<std::int64_t, std::string>> ends_;               ///< attempts whose end was looked at
  std::map<std::pair<std::int64_t, std::int32_t>, AttemptRef> said_;  ///< every attempt that ever left us
  std::map<std::string, std::set<std::int64_t>> newest_;              ///< jobs in each worker's newest orders
};

}  // namespace vantage
