#include "scheduler/dispatch/ready_jobs.h"

#include <algorithm>

namespace vantage {
namespace {

/// Rows read at once: enough to make the statement cheap, few enough to be thrown away at the end of the turn.
constexpr int kRowsAhead = 32;

std::tuple<int, int, JobId, std::size_t> place_of(int priority, int stage, JobId id, std::size_t index) {
  return {-priority, -stage, id, index};
}

}  // namespace

ReadyJobs::ReadyJobs(Store& store) : store_(store) {
  for (ReadyClass& ready : store_.ready_classes()) {
    order_.insert(place_of(ready.priority, ready.stage, ready.first, queues_.size()));
    queues_.push_back({.ready = std::move(ready), .jobs = {}});
  }
}

const ReadyClass* ReadyJobs::first_to_run_alone() const {
  for (const Place& place : order_)
    if (const ReadyClass& ready = queues_[std::get<3>(place)].ready; ready.alone) return &ready;
  return nullptr;
}

void ReadyJobs::read_more(std::size_t index) {
  Queue& queue = queues_[index];
  if (queue.read_to_end || !queue.jobs.empty()) return;
  auto rows = store_.best_of_class(queue.ready.id, kRowsAhead);
  queue.read_to_end = static_cast<int>(rows.size()) < kRowsAhead;
  queue.jobs.assign(std::make_move_iterator(rows.begin()), std::make_move_iterator(rows.end()));
}

std::optional<JobRow> ReadyJobs::take(const SuitsClass& suits_class, const SuitsJob& suits_job) {
  const auto put_back = [&](std::size_t index) {
    const Queue& queue = queues_[index];
    if (queue.jobs.empty()) return;
    const JobRow& best = queue.jobs.front();
    order_.insert(place_of(best.priority, best.stage, best.id, index));
  };
  if (emptied_) {
    read_more(*emptied_);
    put_back(*emptied_);
    emptied_.reset();
  }
  for (auto place = order_.begin(); place != order_.end(); ++place) {
    const std::size_t index = std::get<3>(*place);
    Queue& queue = queues_[index];
    if (!suits_class(queue.ready)) continue;
    read_more(index);
    const auto found = std::find_if(queue.jobs.begin(), queue.jobs.end(), suits_job);
    if (found == queue.jobs.end()) continue;
    JobRow job = std::move(*found);
    queue.jobs.erase(found);
    order_.erase(place);
    if (queue.jobs.empty())
      emptied_ = index;
    else
      put_back(index);
    return job;
  }
  return std::nullopt;
}

}  // namespace vantage
