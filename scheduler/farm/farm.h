#pragma once
/// The scheduler as an object: a thread that owns the farm's database, its bus and every decision.
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "jobs/all_jobs.h"
#include "scheduler/dispatch/command.h"
#include "scheduler/farm/answers.h"
#include "scheduler/farm/farm_stats.h"
#include "scheduler/farm/progress.h"
#include "scheduler/store/rows.h"
#include "schema/base/ids.h"
#include "schema/messages/broker.h"
#include "schema/messages/codec.h"

namespace vantage {

struct SubmitRequest {
  std::filesystem::path folder;  ///< of the shot
  std::string until_kind;        ///< plan no further than this stage and what it needs; empty: everything
  int priority = 0;              ///< higher goes first
  std::string who{};             ///< who asks; empty: the farm itself
};
/// Safe to kill at any moment: the next FarmScheduler on the same folder goes on where this one stopped.
/// All members may be called from any thread.
class FarmScheduler {
 public:
  struct Options {
    std::filesystem::path state_dir;   ///< farm.sqlite, farm.key, lock; `vantage run` uses SHOT/.vantage/farm
    std::string bus_url;               ///< LCM URL; empty: an own broker on a free port of 127.0.0.1
    std::string listen = "127.0.0.1";  ///< address of the own broker
    int broker_port = 0;               ///< of the own broker; 0: any free one, workers elsewhere need a fixed one
    std::string http_address;          ///< what workers and people are told; may come later
    int lease_ms = 15000;
    const std::vector<KindEntry>* kinds = &all_kinds();  ///< that shots are planned with; outlives the scheduler
  };

  /// Takes the folder's lock, mends and opens the database, starts the thread. Throws Error(BadInput) when another
  /// scheduler runs on the folder, it lies on a network file system, or the database is of a newer version.
  explicit FarmScheduler(Options options);
  /// Stops the thread. Attempts that run go on in their workers and are taken back by the next FarmScheduler.
  ~FarmScheduler();
  FarmScheduler(const FarmScheduler&) = delete;
  FarmScheduler& operator=(const FarmScheduler&) = delete;

  const std::string& bus_url() const;       ///< for `vantage-worker --bus`
  std::filesystem::path key_file() const;   ///< secret that signs messages
  std::filesystem::path state_dir() const;  ///< for open_farm_to_read()
  std::string farm_id() const;
  void set_http_address(const std::string& address);
  /// Messages that came to the scheduler and were not believed, by reason, since its start.
  DropCounts dropped_messages() const;

  FarmHealth health() const;
  FarmStats stats() const;
  /// Empty without an own broker.
  std::optional<Broker::Counts> broker_counts() const;

  /// The future throws Error(BadInput) for a shot that cannot be planned: one clear line.
  /// With a key, an order that comes twice is carried out once and answered alike, also after a restart; throws
  /// KeyReused when the key came with another request.
  std::future<SubmitResult> submit(SubmitRequest request, OnceKey once = {});
  /// See command.h. The future throws Error(BadInput) for an unknown target.
  std::future<CommandResult> command(Command command, OnceKey once = {});

  /// Writes a line into the farm's trail of events, soon. kind: "warning", …
  void note(const std::string& kind, const std::string& text);

  /// At most 100 ms old; empty when there is no such shot.
  std::optional<ShotProgress> progress(ShotId shot) const;
  std::vector<ShotProgress> all_progress() const;
  /// Called on the scheduler's thread after a change, at most every 100 ms and always when a shot ends. Be quick.
  void on_change(std::function<void(const ShotProgress&)> listener);
  /// Blocks until the shot is done or failed, or the time is over (empty). Throws what stopped the scheduler, if so.
  std::optional<ShotProgress> wait(ShotId shot, int timeout_ms);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// SHOT/.vantage/store can be made and written and the disk has room. Throws Error(BadInput) otherwise.
void check_store(const std::filesystem::path& shot_folder);

}  // namespace vantage
