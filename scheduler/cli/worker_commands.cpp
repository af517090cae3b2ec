// Commands about workers: workers (list, hours, forgive, selftest), drain, undrain.
#include <fmt/format.h>

#include "scheduler/cli/commands.h"
#include "scheduler/cli/farm_client.h"
#include "scheduler/cli/order_output.h"
#include "scheduler/cli/parse.h"
#include "scheduler/cli/worker_lines.h"
#include "schema/base/clock.h"
#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

struct WorkerOrder {
  std::string worker, hours, server, token_file;
  bool dry_run = false, json = false;
};

/// By its id, its host when only one works there, or the beginning of its id.
std::string find_worker(FarmClient& client, const std::string& name) {
  const Json workers = client.get("/workers", {}).at("workers");
  std::vector<std::string> fitting, known;
  for (const auto& w : workers) {
    const std::string id = w.at("id"), host = w.at("host");
    if (id == name) return id;
    if (host == name || id.starts_with(name)) fitting.push_back(id);
    known.push_back(id);
  }
  if (fitting.size() == 1) return fitting.front();
  if (!fitting.empty())
    throw Error(ErrorKind::BadInput, fmt::format("'{}' may be {}: name one of them", name, fmt::join(fitting, " or ")));
  throw Error(ErrorKind::BadInput, fmt::format("the farm has no worker '{}'{}", name, did_you_mean(name, known)));
}

int order_worker(const std::string& command, const std::string& verb, const char* summary, const Arguments& arguments) {
  CLI::App app{summary, "vantage " + command};
  WorkerOrder order;
  app.add_option("worker", order.worker, "its id, the beginning of it, or its host")->required();
  if (verb == "hours")
    app.add_option("hours", order.hours, "e.g. \"mon-fri 19:00-07:00, sat-sun\", local time of the scheduler; or off")
        ->required();
  app.add_option("--server", order.server, "the scheduler, e.g. http://127.0.0.1:8080")->required();
  app.add_option("--token-file", order.token_file, "file with the token that says who asks; else $VANTAGE_TOKEN");
  app.add_flag("--dry-run", order.dry_run, "say what would happen, change nothing");
  app.add_flag("--json", order.json, "for programs");
  parse(app, arguments);
  const auto client = make_farm_client(order.server, "", order.token_file);
  Json body{{"dry_run", order.dry_run}};
  if (verb == "hours") body["hours"] = order.hours == "off" ? "" : order.hours;
  print_order_result(client->post(fmt::format("/workers/{}/{}", find_worker(*client, order.worker), verb), body),
                     order.dry_run, order.json);
  return kExitOk;
}

int list_workers(const Arguments& arguments) {
  CLI::App app{"Lists the machines that work. 'vantage workers hours|forgive|selftest WORKER' orders one.",
               "vantage workers"};
  std::string shot, server, token_file;
  bool json = false;
  app.add_option("shot", shot, "folder of the shot, or its name with --server");
  app.add_option("--server", server, "a scheduler, e.g. http://127.0.0.1:8080; left out: the shot's own last run");
  app.add_option("--token-file", token_file, "file with the token that says who asks; else $VANTAGE_TOKEN");
  app.add_flag("--json", json, "for programs");
  parse(app, arguments);
  const Json workers = make_farm_client(server, shot, token_file)->get("/workers", {});
  if (json)
    fmt::print("{}\n", workers.dump());
  else
    for (const auto& w : workers.at("workers")) fmt::print("{}", worker_lines(w, system_clock().wall_ms()));
  return kExitOk;
}

}  // namespace

int workers_command(const Arguments& arguments) {
  const std::string verb = arguments.empty() ? "" : arguments.front();
  const Arguments rest(arguments.begin() + (arguments.empty() ? 0 : 1), arguments.end());
  if (verb == "hours")
    return order_worker("workers hours", verb, "Lets a worker begin jobs only at certain hours.", rest);
  if (verb == "forgive")
    return order_worker("workers forgive", verb, "Forgets what failed on a worker, and trusts it again.", rest);
  if (verb == "selftest") return order_worker("workers selftest", verb, "Lets a worker check its machine now.", rest);
  return list_workers(arguments);
}

int drain_command(const Arguments& arguments) {
  return order_worker("drain", "drain", "Lets a worker finish what it runs and take nothing new.", arguments);
}
int undrain_command(const Arguments& arguments) {
  return order_worker("undrain", "undrain", "Lets a drained worker take work again.", arguments);
}

}  // namespace vantage
