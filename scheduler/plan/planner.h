#pragma once
/// Turns shots into rows of jobs, and finished jobs into the next ready ones. All members write within the caller's
/// transaction; the scheduler's thread only.
#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "jobs/all_jobs.h"
#include "scheduler/plan/shot_plan.h"
#include "scheduler/plan/source_hasher.h"
#include "scheduler/store/store.h"
#include "schema/formats/job_file.h"

namespace vantage {

class Planner {
 public:
  Planner(Store& store, const std::vector<KindEntry>& kinds) : store_(store), kinds_(kinds) {}

  /// Large footage is read by it from now on, and its jobs wait meanwhile; without one it is read at once.
  void read_footage_with(SourceHasher& hasher) { hasher_ = &hasher; }
  /// Jobs whose footage has been read go on. Call in every turn.
  void go_on_with_footage();

  struct Submitted {
    ShotRow shot;
    int num_jobs = 0, num_up_to_date = 0;
  };
  /// Starts the next generation of a shot. Jobs whose row and inputs did not change stay done.
  /// Throws Error(BadInput) for a shot that cannot be planned; the caller must then undo what was written.
  Submitted submit(const std::filesystem::path& folder, const std::string& until_kind, int priority);
  /// After a start or a rollback: nothing is remembered, and shots that were under way are planned again from their
  /// files as they are now.
  void resume();

  /// The job has just become good or bad: what needs it is settled or aborted, and the plan may grow.
  void finished(JobId job);

  // What people order. First who is meant:
  /// Throws Error(BadInput), with a suggestion, when there is no such kind.
  void check_kind(const std::string& kind) const;
  /// Those of the jobs that are bad, the bad ones that they need, and what was aborted for want of these alone.
  std::vector<JobId> to_retry(const std::vector<JobId>& roots);
  /// All that needs one of the jobs, however far down; without themselves.
  std::vector<JobId> all_dependents(const std::vector<JobId>& roots);
  // Then the change:
  /// Bad jobs get another chance.
  void retry(ShotId shot, const std::vector<JobId>& bad);
  /// Unfinished jobs are not wanted any more; what needs them is aborted. Or: nothing of the shot is wanted.
  void cancel(const std::vector<JobId>& unfinished);
  void cancel(ShotId shot);
  /// Finished jobs are run again although their artifacts are in the store.
  void rerun(ShotId shot, const std::vector<JobId>& good);
  /// All jobs of a kind, also those planned later. ready, paused: those in that state.
  void pause_stage(ShotId shot, const std::string& kind, const std::vector<JobId>& ready);
  void resume_stage(ShotId shot, const std::string& kind, const std::vector<JobId>& paused);
  /// A job that is in no plan: it is ready, for the caller to hand it out at once. The same name is the same row.
  JobRow make_ready_outside_plan(ShotId shot, const KindSpec& spec, const WorkUnit& unit);
  /// Before an attempt: an artifact that is not trusted gives way, to SHOT/.vantage/aside/. False when it cannot: the
  /// job has failed.
  bool move_suspect_aside(const JobRow& job);

  /// A ready job whose source changed under it, or a paused one that may go on: looks at it anew.
  void recheck(const JobRow& job);
  /// Ends the open attempts of a job; take_revoked() tells which.
  void revoke(JobId job);

  /// Plans one shot again, if one asks for it. False when none does.
  bool expand_one();
  /// Shots without unfinished jobs become done or failed. Call when expand_one() has nothing left to do.
  void end_finished_shots();

  /// A valid artifact for a job's key is in the store: the job is done without being run (again).
  /// False when there is none.
  bool salvage(const JobRow& job, JobState to, const std::string& reason);
  /// The job has a new artifact: is it what one that was not trusted had been?
  void compare_with_suspect(const JobBrief& job, const std::string& key, const std::string& content);
  /// False for kinds that leave no artifact behind: their workers are believed.
  bool publishes(const std::string& kind) const;
  /// Content hash of what a worker says it has made for the job's key; empty when it is not (yet) there to be read.
  std::optional<std::string> content_made(const JobBrief& job);
  /// The job needs no process of its own.
  bool runs_in_worker(const std::string& kind) const;
  /// The job's footage is what it was when its key was made. Throws Error(BadInput) when it is gone.
  bool key_holds(const JobRow& job);
  /// All that an attempt of a job whose needs are met has to know.
  JobFile job_file(const JobRow& job);
  /// SHOT/.vantage
  std::filesystem::path private_folder(ShotId shot);

  /// What happened since the last call, for those who must act on it after the commit.
  struct Effects {
    std::vector<JobId> landed;  ///< have a new artifact
    std::set<ShotId> ended;     ///< became done or failed
    std::set<ShotId> changed;   ///< anything at all
  };
  Effects take_effects() { return std::exchange(effects_, {}); }
  /// Attempts ended by us since the last call: their workers must stop them.
  std::vector<AttemptRow> take_revoked() { return std::exchange(revoked_, {}); }
  /// Something of the shot changed that people see.
  void touch(ShotId shot) { effects_.changed.insert(shot); }

 private:
  struct Plan {
    Shot shot{};
    std::string until_kind{};
    std::int64_t generation = 0;
    std::set<std::string> asked{}, missing{};
  };
  using Rows = std::unordered_map<std::string, JobOutline>;

  const KindSpec* spec_of(const std::string& kind) const;
  Plan& plan_of(ShotId shot);
  Plan read_plan(const ShotRow& row);
  ShotPlan ask_kinds(ShotId shot, Plan& plan);
  void expand(ShotId shot, bool strict);
  void apply(ShotId shot, const Plan& plan, const ShotPlan& wanted);
  void apply_unit(const ShotRow& shot, const PlannedUnit& planned, Rows& rows,
                  std::unordered_set<std::string>& touched);
  JobRow write_unit(const ShotRow& shot, const PlannedUnit& planned, const std::string& hash, const JobOutline* old);
  void drop_unwanted(const ShotRow& shot, const ShotPlan& wanted, const Rows& rows);
  std::optional<std::filesystem::path> artifact_of(ShotId shot, const std::string& job);

  std::string source_hash(const std::filesystem::path& path);
  void wait_for_footage(const JobRow& job, const std::filesystem::path& path);
  void settle(const JobRow& job);
  std::optional<std::string> content_of(const JobRow& job, const std::string& key);
  void make_ready(const JobRow& job, const std::string& key, const Json& identity);
  void settle_dependents(JobId job);
  void abort_dependents(const JobBrief& job);
  void block(JobId job, JobState state, const std::string& reason);
  void settle_all(const std::vector<JobId>& blocked);
  /// The artifact for its key is in the store, but a person wants it made again.
  bool is_suspect(const JobRow& job, const std::string& key);
  void move(JobId job, JobState to, const std::string& reason);
  void moved(JobId job, ShotId shot, JobState to);

  Store& store_;
  SourceHasher* hasher_ = nullptr;
  std::map<std::filesystem::path, std::set<JobId>> wait_for_footage_;
  const std::vector<KindEntry>& kinds_;
  std::map<ShotId, Plan> plans_;
  std::set<ShotId> to_expand_, to_end_;
  std::vector<JobId> open_;  ///< finished jobs whose dependents wait to be looked at
  bool closing_ = false;
  Effects effects_;
  std::vector<AttemptRow> revoked_;
};

}  // namespace vantage
