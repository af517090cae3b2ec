#include "tests/protocol/checks.h"

#include <fmt/format.h>

#include "jobs/job_kind.h"
#include "schema/formats/manifest.h"

namespace vantage {

Checks::Checks(const std::filesystem::path& database, std::filesystem::path store, const Ledger& ledger)
    : db_(database, Sqlite::Mode::ReadOnly), store_(std::move(store)), ledger_(ledger) {}

void Checks::after_commit() {
  const std::int64_t version = db_.integer_or(0, "PRAGMA data_version");
  if (version == version_) return;
  version_ = version;
  counts_are_right();
  active_jobs_have_one_open_attempt();
  good_jobs_stay_good();
  new_attempts_are_needed();
  ends_were_real();
  note_ends();
}

void Checks::counts_are_right() {
  const std::int64_t num_jobs = db_.integer_or(0, "SELECT count(*) FROM job");
  if (num_jobs < num_jobs_) fail(fmt::format("{} jobs were lost", num_jobs_ - num_jobs));
  num_jobs_ = num_jobs;
  const std::string wrong = db_.text_or(
      "",
      "SELECT name FROM job WHERE num_unmet <> (SELECT count(*) FROM dependency d JOIN job n ON n.id = d.needs_id "
      "WHERE d.job_id = job.id AND n.state NOT IN ('done', 'skipped')) OR (state = 'blocked' AND num_unmet = 0)");
  if (!wrong.empty()) fail(fmt::format("{}: counts its unmet needs wrongly, or waits for nothing", wrong));
}

void Checks::active_jobs_have_one_open_attempt() {
  const std::string wrong =
      db_.text_or("",
                  "SELECT name || ' is ' || state FROM job WHERE (state IN ('leased', 'running', 'reconnect')) <> "
                  "(SELECT count(*) FROM attempt WHERE job_id = job.id AND state <> 'ended')");
  if (!wrong.empty()) fail(fmt::format("{}: an active job has one open attempt, any other none", wrong));
}

void Checks::good_jobs_stay_good() {
  std::set<std::int64_t> seen;
  for (Query q = db_.query("SELECT id, name, kind, key, content, state FROM job WHERE state IN ('done', 'skipped')");
       q.step();) {
    seen.insert(q.integer(0));
    const auto [entry, is_new] = good_.try_emplace(q.integer(0), q.text(3), q.text(4));
    if (entry->second != std::pair(q.text(3), q.text(4))) fail(q.text(1) + ": its result was replaced by another");
    check_result(q.text(2), q.text(3), q.text(4));
  }
  for (const auto& [id, result] : good_)
    if (!seen.contains(id)) fail(fmt::format("job {}: was finished and is not any more", id));
  const std::string twice = db_.text_or("",
                                        "SELECT job_id FROM attempt WHERE outcome = 'done' GROUP BY job_id, key "
                                        "HAVING count(*) > 1");
  if (!twice.empty()) fail(fmt::format("job {}: two attempts are believed to have made its result", twice));
}

void Checks::check_result(const std::string& kind, const std::string& key, const std::string& content) {
  if (content == kNothingPublished || !results_.insert(key).second) return;
  const auto manifest = read_valid_manifest(artifact_folder(store_, kind, key));
  if (!manifest) fail(fmt::format("{} {}: is said to be finished, but the store does not have it", kind, key));
  if (manifest->content != content) fail(fmt::format("{} {}: the store has something else", kind, key));
}

void Checks::new_attempts_are_needed() {
  for (Query q = db_.query("SELECT attempt.id, name, kind, attempt.key, token FROM attempt JOIN job ON job.id = job_id "
                           "WHERE attempt.id > ? ORDER BY attempt.id",
                           last_attempt_);
       q.step();) {
    last_attempt_ = q.integer(0);
    if (!tokens_.insert(q.integer(4)).second) fail(q.text(1) + ": a token was used again");
    if (read_valid_manifest(artifact_folder(store_, q.text(2), q.text(3))))
      fail(q.text(1) + ": was handed out although the store has its result");
  }
}

/// What the database says of an attempt, some worker said in these words.
void Checks::ends_were_real() {
  for (Query q = db_.query("SELECT id, job_id, number, token, outcome FROM attempt "
                           "WHERE outcome IN ('done', 'failed', 'crashed')");
       q.step();) {
    const std::string outcome = q.text(4);
    if (!ends_.emplace(q.integer(0), outcome).second) continue;
    const AttemptRef ref{q.integer(1), static_cast<std::int32_t>(q.integer(2)), q.integer(3)};
    const auto found = ledger_.ends.find(ref);
    const auto was = [&](Outcome o) { return found != ledger_.ends.end() && found->second.contains(o); };
    const bool real = outcome == "done"     ? was(Outcome::Done)
                      : outcome == "failed" ? was(Outcome::Failed) || was(Outcome::Done)  // Done, but not to be read
                                            : was(Outcome::Crashed);
    if (!real) fail(fmt::format("attempt {} of job {}: no worker said that it {}", ref.number, ref.job_id, outcome));
  }
}

void Checks::note_ends() {
  for (Query q = db_.query("SELECT job_id, number, token FROM attempt WHERE state = 'ended'"); q.step();)
    ended_.insert({q.integer(0), static_cast<std::int32_t>(q.integer(1)), q.integer(2)});
}

void Checks::on_stop(const AttemptRef& ref) const {
  if (!ended_.contains(ref))
    fail(fmt::format("attempt {} of job {} is stopped, but nobody has ended it", ref.number, ref.job_id));
}

void Checks::on_orders(const WorkerOrders& orders) {
  std::set<std::int64_t>& jobs = newest_[orders.worker_id];
  jobs.clear();
  for (const Assignment& a : orders.assigned) {
    jobs.insert(a.ref.job_id);
    const auto [entry, is_new] = said_.try_emplace({a.ref.job_id, a.ref.number}, a.ref);
    if (entry->second != a.ref) fail(fmt::format("attempt {} of job {} has two tokens", a.ref.number, a.ref.job_id));
    const std::string state = db_.text_or(
        "nowhere", "SELECT state FROM attempt WHERE job_id = ? AND number = ? AND token = ? AND worker_id = ?",
        a.ref.job_id, a.ref.number, a.ref.token, orders.worker_id);
    if (state != "leased" && state != "running")
      fail(fmt::format("{} is told to run attempt {} of job {}, which is {} in the database", orders.worker_id,
                       a.ref.number, a.ref.job_id, state));
  }
  for (const AttemptRef& ref : orders.acked)
    if (db_.text_or("", "SELECT state FROM attempt WHERE job_id = ? AND number = ? AND token = ?", ref.job_id,
                    ref.number, ref.token) != "ended" &&
        ledger_.ends.contains(ref))
      fail(fmt::format("attempt {} of job {} is acknowledged before its end is committed", ref.number, ref.job_id));
}

void Checks::after_flush() {
  std::map<std::int64_t, std::string> holder;
  for (const auto& [worker, jobs] : newest_) {
    // Nothing is said to a worker that was given up; its leases have run out.
    if (db_.text_or("", "SELECT state FROM worker WHERE id = ?", worker) == "lost") continue;
    for (const std::int64_t job : jobs)
      if (const auto [entry, is_new] = holder.try_emplace(job, worker); !is_new)
        fail(fmt::format("job {} is leased to {} and to {}", job, entry->second, worker));
  }
}

void Checks::at_the_end() {
  after_commit();
  const std::string open = db_.text_or("",
                                       "SELECT name || ' is ' || state FROM job WHERE state NOT IN ('done', "
                                       "'skipped') AND generation = (SELECT generation FROM shot)");
  if (!open.empty()) fail(open + " at the end");
  if (db_.integer_or(0, "SELECT count(*) FROM attempt WHERE state <> 'ended'") > 0)
    fail("an attempt is open at the end");
}

std::string Checks::what_is_open() {
  std::string text;
  for (Query q = db_.query("SELECT name, state, reason, num_attempts, not_before_ms FROM job WHERE state NOT IN "
                           "('done', 'skipped')");
       q.step();)
    text += fmt::format("\n  {} is {} ({}), {} attempts", q.text(0), q.text(1), q.text(2), q.integer(3));
  return text;
}

}  // namespace vantage
