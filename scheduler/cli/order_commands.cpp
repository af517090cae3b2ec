// Commands that ask a scheduler to change something: submit, pause, resume, cancel, retry.
#include <fmt/format.h>

#include "jobs/all_jobs.h"
#include "scheduler/cli/commands.h"
#include "scheduler/cli/farm_client.h"
#include "scheduler/cli/parse.h"
#include "scheduler/cli/shot_facts.h"
#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

struct Order {
  std::string shot, job, server, token_file, until;
  int priority = 0;
  bool json = false;
};

void declare(CLI::App& app, Order& order) {
  app.add_option("shot", order.shot, "folder of the shot, or its name")->required();
  app.add_option("--server", order.server, "the scheduler, e.g. http://127.0.0.1:8080")->required();
  app.add_option("--token-file", order.token_file, "file with the token that says who asks; else $VANTAGE_TOKEN");
  app.add_flag("--json", order.json, "for programs");
}

int give_order(const char* verb, const char* summary, const Arguments& arguments) {
  CLI::App app{summary, fmt::format("vantage {}", verb)};
  Order order;
  declare(app, order);
  app.add_option("job", order.job, "one job instead of the whole shot");
  parse(app, arguments);
  const auto client = make_farm_client(order.server, order.shot, order.token_file);
  const std::int64_t shot = find_shot(*client, order.shot);
  const std::string target =
      order.job.empty() ? fmt::format("/shots/{}", shot) : fmt::format("/jobs/{}", find_job(*client, shot, order.job));
  const Json answer = client->post(target + "/" + verb, Json::object());
  fmt::print("{}\n", order.json ? answer.dump() : answer.at("text").get<std::string>());
  return kExitOk;
}

}  // namespace

int submit_command(const Arguments& arguments) {
  CLI::App app{"Gives a shot to a scheduler, which must see the folder under the same path.", "vantage submit"};
  Order order;
  declare(app, order);
  app.add_option("--until", order.until, "stop after this stage");
  app.add_option("--priority", order.priority, "higher goes first")->capture_default_str();
  parse(app, arguments);
  if (!order.until.empty() && find_kind(order.until) == nullptr)
    throw Error(ErrorKind::BadInput,
                fmt::format("--until {}: no such stage{}", order.until, did_you_mean(order.until, kind_names())));
  const Shot shot = read_checked_shot(order.shot);
  const Json answer =
      make_farm_client(order.server, shot.folder, order.token_file)
          ->post("/shots", {{"folder", shot.folder.string()}, {"until", order.until}, {"priority", order.priority}});
  if (order.json)
    fmt::print("{}\n", answer.dump());
  else
    fmt::print("{} is shot {}: {} jobs planned so far, {} up to date. See {}/#shot={}\n", shot.name,
               answer.at("shot").get<int>(), answer.at("num_jobs").get<int>(), answer.at("num_up_to_date").get<int>(),
               order.server, answer.at("shot").get<int>());
  return kExitOk;
}

int pause_command(const Arguments& arguments) {
  return give_order("pause", "Starts no more jobs; what runs goes on to its end.", arguments);
}
int resume_command(const Arguments& arguments) {
  return give_order("resume", "Goes on with what was paused.", arguments);
}
int cancel_command(const Arguments& arguments) {
  return give_order("cancel", "Stops and gives up a shot or a job.", arguments);
}
int retry_command(const Arguments& arguments) {
  return give_order("retry", "Runs failed jobs, and what waited for them, again.", arguments);
}

}  // namespace vantage
