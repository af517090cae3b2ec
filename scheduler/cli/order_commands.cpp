// Commands that ask a scheduler to change something: submit, pause, resume, cancel, retry, rerun, priority.
#include <fmt/format.h>

#include <charconv>
#include <utility>

#include "jobs/all_jobs.h"
#include "scheduler/cli/commands.h"
#include "scheduler/cli/farm_client.h"
#include "scheduler/cli/order_output.h"
#include "scheduler/cli/parse.h"
#include "scheduler/cli/shot_facts.h"
#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

struct Order {
  std::string shot, target, server, token_file, until, stage;
  int priority = 0;
  bool dry_run = false, json = false;
};

void declare(CLI::App& app, Order& order) {
  app.add_option("shot", order.shot, "folder of the shot, or its name")->required();
  app.add_option("--server", order.server, "the scheduler, e.g. http://127.0.0.1:8080")->required();
  app.add_option("--token-file", order.token_file, "file with the token that says who asks; else $VANTAGE_TOKEN");
  app.add_flag("--json", order.json, "for programs");
}

void declare_target(CLI::App& app, Order& order) {
  app.add_option("--stage", order.stage, "one stage instead of the whole shot, e.g. depth");
  app.add_flag("--dry-run", order.dry_run, "say what would happen, change nothing");
}

bool is_stage(const std::string& word) { return find_kind(word) != nullptr; }

/// Sends the order to the shot, one of its stages or one of its jobs. A word that names a stage means the stage.
int send_order(const std::string& verb, Order order, Json body) {
  if (order.stage.empty() && is_stage(order.target)) std::swap(order.stage, order.target);
  if (!order.stage.empty() && !is_stage(order.stage))
    throw Error(ErrorKind::BadInput,
                fmt::format("--stage {}: no such stage{}", order.stage, did_you_mean(order.stage, kind_names())));
  if (!order.stage.empty() && !order.target.empty())
    throw Error(ErrorKind::BadInput,
                fmt::format("name a job ({}) or a stage ({}), not both", order.target, order.stage));
  const auto client = make_farm_client(order.server, order.shot, order.token_file);
  const std::int64_t shot = find_shot(*client, order.shot);
  if (!order.stage.empty()) body["stage"] = order.stage;
  if (order.dry_run) body["dry_run"] = true;
  const std::string path = order.target.empty() ? fmt::format("/shots/{}", shot)
                                                : fmt::format("/jobs/{}", find_job(*client, shot, order.target));
  print_order_result(client->post(path + "/" + verb, body), order.dry_run, order.json);
  return kExitOk;
}

int give_order(const char* verb, const char* summary, const Arguments& arguments) {
  CLI::App app{summary, fmt::format("vantage {}", verb)};
  Order order;
  declare(app, order);
  declare_target(app, order);
  app.add_option("job", order.target, "one job, or one stage, instead of the whole shot");
  parse(app, arguments);
  return send_order(verb, order, Json::object());
}

int parse_priority(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size())
    throw Error(ErrorKind::BadInput, fmt::format("priority '{}': expected a whole number", text));
  return value;
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

int rerun_command(const Arguments& arguments) {
  CLI::App app{"Makes finished results again although they are there; what needs them follows where they differ.",
               "vantage rerun"};
  Order order;
  declare(app, order);
  declare_target(app, order);
  app.add_option("job", order.target, "the job, or the stage");
  parse(app, arguments);
  if (order.target.empty() && order.stage.empty())
    throw Error(ErrorKind::BadInput, "vantage rerun: name the job or the stage whose results shall be made again");
  return send_order("rerun", order, Json::object());
}

int priority_command(const Arguments& arguments) {
  CLI::App app{"Lets a shot, a stage or a job go before (or, below 0, after) others.", "vantage priority"};
  Order order;
  std::vector<std::string> words;
  declare(app, order);
  declare_target(app, order);
  app.add_option("words", words, "[JOB|STAGE] N: higher goes first; submissions begin with 0")
      ->required()
      ->expected(1, 2);
  parse(app, arguments);
  if (words.size() == 2) order.target = words.front();
  return send_order("priority", order, {{"priority", parse_priority(words.back())}});
}

}  // namespace vantage
