#pragma once
#include <atomic>
#include <filesystem>
#include <functional>

#include "scheduler/api/http_counts.h"
#include "scheduler/api/http_library.h"
#include "scheduler/api/limited_server.h"
#include "scheduler/api/route_table.h"
#include "scheduler/dispatch/command.h"
#include "scheduler/farm/farm.h"

namespace vantage {

/// How the farm is, beyond what its database says.
struct FarmState {
  FarmHealth health{};
  FarmStats stats{};
  DropCounts drops{};
  std::optional<Broker::Counts> broker{};
};

/// What the server may ask of the farm; submit and command block until the farm has answered, and throw what it throws.
struct FarmControl {
  std::function<SubmitResult(SubmitRequest, OnceKey)> submit;
  std::function<CommandResult(Command, OnceKey)> command;
  std::function<FarmState()> state;
};

/// Answers that need more than the database. One object for all threads of the server.
class Handlers {
 public:
  struct Context {
    std::filesystem::path state_dir;
    FarmControl control;
    HttpLimits limits;
    Gate* gate = nullptr;
    LimitedServer* server = nullptr;
    HttpCounts* counts = nullptr;
    std::string cookie;  ///< its name
  };
  explicit Handlers(Context context) : context_(std::move(context)) {}

  void metrics(const Call& call, httplib::Response& res);
  void openapi(const Call& call, httplib::Response& res);
  void health(const Call& call, httplib::Response& res);
  void session(const Call& call, httplib::Response& res);
  void open_session(const Call& call, httplib::Response& res);

  void events(const Call& call, httplib::Response& res);

  void log(const Call& call, httplib::Response& res);
  void preview(const Call& call, httplib::Response& res);
  void out_file(const Call& call, httplib::Response& res);
  void store_file(const Call& call, httplib::Response& res);

  void submit(const Call& call, httplib::Response& res);
  void order_shot(const Call& call, httplib::Response& res);
  void order_job(const Call& call, httplib::Response& res);
  void order_worker(const Call& call, httplib::Response& res);

  const std::filesystem::path& state_dir() const { return context_.state_dir; }

 private:
  void shot_file(const Call& call, const std::string& folder, httplib::Response& res) const;
  void order(const Call& call, Command command, httplib::Response& res);

  Context context_;
  std::atomic<int> num_streams_{0};
};

/// {"error": "…"} and such: bytes of other encodings in texts do not spoil the answer.
void answer_json(httplib::Response& res, const Json& value, int status = 200);

}  // namespace vantage
