#pragma once
#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include "scheduler/store/store.h"

namespace vantage {

/// What can be claimed in one turn, best first. Reads rows class by class, some ahead, as they are asked for. A job
/// that was taken must leave the state ready before the next is asked for, or it is not offered again in this turn.
class ReadyJobs {
 public:
  explicit ReadyJobs(Store& store);

  using SuitsClass = std::function<bool(const ReadyClass&)>;
  using SuitsJob = std::function<bool(const JobRow&)>;
  /// The best job that suits both. Of a class, only the next few jobs are shown to suits_job.
  std::optional<JobRow> take(const SuitsClass& suits_class, const SuitsJob& suits_job);

  bool empty() const { return order_.empty(); }
  /// The first class of jobs that crashed before and wait for a worker of their own; nullptr when there is none.
  const ReadyClass* first_to_run_alone() const;

 private:
  struct Queue {
    ReadyClass ready;
    std::deque<JobRow> jobs;
    bool read_to_end = false;
  };
  using Place = std::tuple<int, int, JobId, std::size_t>;  ///< -priority, -stage, id of the class's best job; its index
  void read_more(std::size_t index);

  Store& store_;
  std::vector<Queue> queues_;
  std::set<Place> order_;
  std::optional<std::size_t> emptied_;  ///< its last row was taken and may still be ready in the database
};

}  // namespace vantage
