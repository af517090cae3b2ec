#pragma once
/// A farm of real processes that runs short jobs, for tests that hurt it: vantage-short-farm on ports of its own, and
/// vantage-short-worker as often as wanted.
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "schema/base/json.h"
#include "tests/support/processes.h"

namespace vantage::faults {

/// Writes SHOT/shot.toml: two cameras that nobody opens, and the tables of short jobs.
void write_short_shot(const std::filesystem::path& shot, const std::string& tables);

/// Where a process runs: in a network namespace, with more in its environment ("NAME=value").
struct Place {
  std::string netns{};
  std::vector<std::string> environment{};
};
/// The command line that runs argv there. The process that is started becomes the program.
std::vector<std::string> at_place(const Place& place, const std::vector<std::string>& argv);

class ShortFarm {
 public:
  struct Settings {
    int lease_ms = 2000;
    std::string bus{};                     ///< LCM URL; empty: its own broker
    std::string bus_listen = "127.0.0.1";  ///< address of that
    Place place{};
  };
  /// folder: gets the state, the shots and what the processes print. Nothing is started yet.
  explicit ShortFarm(std::filesystem::path folder) : ShortFarm(std::move(folder), Settings{}) {}
  ShortFarm(std::filesystem::path folder, Settings settings);

  /// Starts the scheduler, or starts it again on the same state and ports, and waits until it answers.
  void start();
  /// kill -9
  void kill();
  /// As start(), but does not wait for an answer: for schedulers that refuse to start.
  void launch();
  pid_t pid() const { return scheduler_->pid(); }
  Running& scheduler() { return *scheduler_; }
  Place& place() { return settings_.place; }

  /// Submits a folder below folder() and returns the shot's id.
  std::int64_t submit(const std::filesystem::path& shot);
  /// `vantage ARGS --server URL`, as a person would ask.
  std::string ask(std::vector<std::string> arguments);
  Json get(const std::string& path);
  /// Value of a line of /metrics that begins so; 0 when there is none.
  double metric(const std::string& name);
  Json post(const std::string& path, const Json& body);

  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path state() const { return folder_ / "farm"; }
  std::string printed() const;  ///< by the scheduler, all starts
  std::string bus() const;      ///< for workers
  std::string url() const;

 private:
  std::optional<std::string> try_get(const std::string& path);

  std::filesystem::path folder_;
  Settings settings_;
  int http_port_, bus_port_;
  std::unique_ptr<Running> scheduler_;
};

class ShortWorker {
 public:
  struct Settings {
    int slots = 2;
    int ram_mb = 4000;
    Place place{};
    std::string bus{};      ///< empty: the farm's
    std::string program{};  ///< empty: vantage-short-worker
  };
  ShortWorker(ShortFarm& farm, const std::string& name) : ShortWorker(farm, name, Settings{}) {}
  /// Starts it. name: of its state folder below the farm's folder.
  ShortWorker(ShortFarm& farm, const std::string& name, Settings settings);

  /// Starts it again on the same state.
  void start();
  void signal(int number);
  /// kill -9 of the worker alone; its children are its own business.
  void kill();
  bool is_running() { return !process_->ended(); }
  pid_t pid() const { return process_->pid(); }
  /// The process that forks its jobs; none while a new one comes up.
  std::vector<pid_t> fork_server() const { return children_of(pid()); }
  /// The jobs that it runs.
  std::vector<pid_t> children() const {
    std::vector<pid_t> jobs;
    for (const pid_t server : fork_server())
      for (const pid_t job : children_of(server)) jobs.push_back(job);
    return jobs;
  }
  std::filesystem::path state() const { return farm_.folder() / name_; }
  std::string printed() const;
  /// As in worker.json.
  std::string id() const;
  Place& place() { return settings_.place; }

 private:
  ShortFarm& farm_;
  std::string name_;
  Settings settings_;
  std::unique_ptr<Running> process_;
};

}  // namespace vantage::faults
