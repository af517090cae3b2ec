#pragma once
/// The farm's truth: the one connection that writes. One thread uses it.
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "scheduler/store/rows.h"
#include "scheduler/store/sqlite.h"
#include "scheduler/store/tally.h"
#include "schema/base/clock.h"

namespace vantage {

/// All changes between begin() and commit() become durable together, or not at all.
class Store {
 public:
  /// Opens, checks and migrates FILE. Throws as migrate() does.
  Store(const std::filesystem::path& file, const Clock& clock);

  void begin();
  void commit();
  void rollback();
  /// Between transactions: keeps the journal below some 64 MB, or a quarter of what is free, and cuts it off every 15
  /// minutes.
  void keep_journal_short();
  /// Undoes what fn wrote when it throws, and lets the exception through; the transaction goes on.
  void guarded(const std::function<void()>& fn);

  std::string meta(const std::string& key);
  void set_meta(const std::string& key, const std::string& value);

  // Shots.
  /// Makes the row, or starts its next generation, and returns it in state running.
  ShotRow submit_shot(const std::filesystem::path& folder, const std::string& name, const std::string& until_kind,
                      int priority);
  std::optional<ShotRow> shot(ShotId id);
  std::vector<ShotRow> shots_in_state(const std::string& state);
  void set_shot_state(ShotId id, const std::string& state, const std::string& error);
  void set_shot_priority(ShotId id, int priority);

  // Jobs.
  std::optional<JobRow> job(JobId id);
  std::optional<JobRow> find_job(ShotId shot, const std::string& name);
  std::optional<JobBrief> brief(JobId id);
  /// All jobs of a shot that any plan ever had, in the order of their ids.
  std::vector<JobOutline> outlines_of(ShotId shot);
  JobOutline outline(JobId id);
  /// Jobs of the shot's present plan that have their artifact and links to it.
  std::vector<JobRow> good_jobs_of(ShotId shot);
  /// Jobs of the shot's present plan in one of these states; of one kind, or of all when it is empty.
  std::vector<JobId> planned_in_states(ShotId shot, std::initializer_list<JobState> states,
                                       const std::string& kind = "");
  bool has_planned_unfinished(ShotId shot);
  int num_planned_bad(ShotId shot);
  /// Jobs of the shot's present plan, and how many of them have their artifact.
  struct NumPlanned {
    int all = 0, good = 0;
  };
  NumPlanned num_planned(ShotId shot);
  /// New row in state blocked.
  JobId insert_job(const JobRow& row);
  /// What the plan says of the job: kind to timeout_s, generation and plan_hash; not its state, key or counters.
  void update_plan(const JobRow& row);
  void set_generation(JobId id, std::int64_t generation);
  void set_needs(JobId id, const std::vector<JobId>& needs, int num_unmet);
  void set_num_unmet(JobId id, int num_unmet);
  void set_content(JobId id, const std::string& content);
  void set_job_priority(JobId id, int priority);
  void set_progress(JobId id, const std::string& phase, double progress);
  void set_resources(JobId id, int ram_mb, int timeout_s);
  void set_retry(JobId id, int num_failures, int num_crashes, std::int64_t not_before_ms);
  void set_error(JobId id, const std::string& error_kind, const std::string& error);
  std::vector<JobId> needs_of(JobId id);
  /// Jobs that need this one, of the same generation.
  std::vector<JobId> dependents_of(JobId id);

  /// Every change of a state goes through these: they check the table of moves, write the reason, keep the counts and
  /// num_unmet of the jobs that need this one, and write an event, except where another row says the same: the first
  /// becoming ready (the job's reason), claimed and running (the attempt). Moving to the state that it has is nothing.
  void move(JobId id, JobState to, const std::string& reason);
  struct Keyed {
    std::string key, identity, content;  ///< content: of its artifact, '' when it is to be made
    bool forget_failures = false;        ///< and errors
  };
  /// To ready, or to skipped or done where content says that the artifact is there.
  void move_with_key(JobId id, JobState to, const std::string& reason, const Keyed& keyed);
  /// The attempt ended well and so does the job, in one go.
  void finish(const AttemptRef& ref, const DoneAttempt& report, const std::string& content);

  // Claims.
  /// The claim rule: classes of jobs that can be claimed now, the one with the best job first.
  std::vector<ReadyClass> ready_classes();
  /// The best jobs of a class, best first.
  std::vector<JobRow> best_of_class(std::int64_t class_id, int limit);
  /// Jobs that waited for their next try and whose time has come can be claimed from now on.
  void wake_waiting();
  /// Rises whenever there may be something to claim that was not there before.
  std::int64_t num_woken() const { return num_woken_; }

  // Attempts.
  /// A new attempt, whose number must be the next of the job, and the job leased.
  void begin_attempt(const JobRow& job, const AttemptRef& ref, const std::string& worker_id,
                     const std::string& log_path);
  void start_attempt(const AttemptRef& ref);
  void end_attempt(const AttemptRef& ref, const std::string& outcome, const DoneAttempt& report);
  /// A worker that was thought lost still has it.
  void reopen_attempt(const AttemptRef& ref);
  /// Empty also when number or token differ.
  std::optional<AttemptRow> attempt(const AttemptRef& ref);
  std::vector<AttemptRow> open_attempts();
  std::vector<AttemptRow> open_attempts_of(JobId job);

  /// Since this object was made, by outcome.
  const std::map<std::string, std::int64_t>& num_ended() const { return num_ended_; }

  // Workers and events.
  void upsert_worker(const WorkerReport& report, const std::string& state);
  void set_worker_state(const std::string& id, const std::string& state);
  std::optional<std::string> worker_state(const std::string& id);
  /// kind: submitted, state, attempt, worker, command, decision (of the scheduler, worth a person's look), warning.
  void add_event(std::optional<ShotId> shot, std::optional<JobId> job, const std::string& worker,
                 const std::string& kind, const std::string& text);

  /// What was answered to an order with this key within a day. Throws KeyReused when it came with another request.
  std::optional<std::string> kept_answer(const OnceKey& once);
  void keep_answer(const OnceKey& once, const std::string& answer);

  /// Throws Error(BadInput) when the file is not there.
  static FileStamp stamp_of(const std::filesystem::path& path);
  /// Hash of a file's bytes, if it was read as it is now; else empty.
  std::string known_source_hash(const std::filesystem::path& path, const FileStamp& stamp);
  void set_source_hash(const std::filesystem::path& path, const FileStamp& stamp, const std::string& hash);
  void set_reason(JobId id, const std::string& reason);

  /// Preferably one that runs.
  std::optional<ShotRow> newest_shot();
  void set_num_awaited(ShotId shot, int num);
  // How workers stand; see schema/sql/0003_operating.sql.
  void set_worker_hours(const std::string& id, const std::string& hours);
  void set_worker_set_aside(const std::string& id, const std::string& why);
  struct WorkerFailure {
    JobId job;
    std::string kind;
    std::int64_t at_ms = 0;
    bool of_kind = true, in_row = true;
  };
  void put_worker_failure(const std::string& worker, const WorkerFailure& failure);
  void forget_worker_failures(const std::string& worker);
  std::vector<WorkerFailure> worker_failures(const std::string& worker);

  // What people ordered; see schema/sql/0003_operating.sql.
  struct StageSetting {
    bool paused = false;
    std::optional<int> priority;  ///< empty: the shot's
  };
  StageSetting stage_setting(ShotId shot, const std::string& kind);
  void set_stage_setting(ShotId shot, const std::string& kind, const StageSetting& setting);
  /// An artifact that a person wants made again.
  struct Suspect {
    std::string content, aside, who;
  };
  std::optional<Suspect> suspect(ShotId shot, const std::string& kind, const std::string& key);
  void add_suspect(const JobRow& job, const std::string& who);
  void set_suspect_aside(const JobRow& job, const std::string& folder);
  void remove_suspect(ShotId shot, const std::string& kind, const std::string& key);

  Sqlite& db() { return db_; }
  const Clock& clock() const { return clock_; }
  const std::string& who() const { return who_; }

 private:
  friend class ActingAs;
  void count(const JobBrief& job, int sign);
  /// Runs a change of a job's row and keeps the counts.
  void changing(JobId id, const std::function<void()>& change);
  JobBrief check_move(JobId id, JobState to);
  void after_move(const JobBrief& before, JobState to, const std::string& reason);
  std::int64_t class_of(const JobRow& row, bool alone);
  void forget_caches();

  Sqlite db_;
  const Clock& clock_;
  std::map<std::string, std::int64_t> num_ended_;
  std::string who_;
  Tally tally_;
  std::unordered_map<ShotId, ShotRow> shots_;                ///< as in the database
  std::unordered_map<std::string, std::int64_t> class_ids_;  ///< as in the database
  std::optional<bool> has_suspects_;                         ///< as in the database
  std::int64_t num_woken_ = 0;
  std::int64_t checkpoint_ms_ = 0;         ///< monotonic: the last one
  std::uintmax_t max_journal_bytes() const;
  std::uintmax_t journal_mark_bytes_ = 0;  ///< checkpoint when the journal is longer
};

/// While it lives, events are written as this person's doing.
class ActingAs {
 public:
  ActingAs(Store& store, std::string who) : store_(store) { store_.who_ = std::move(who); }
  ~ActingAs() { store_.who_.clear(); }
  ActingAs(const ActingAs&) = delete;
  ActingAs& operator=(const ActingAs&) = delete;

 private:
  Store& store_;
};

}  // namespace vantage
