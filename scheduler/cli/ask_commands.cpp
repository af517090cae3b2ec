// Commands that ask: status, jobs, logs, why.
#include <fmt/format.h>

#include "jobs/all_jobs.h"
#include "scheduler/cli/commands.h"
#include "scheduler/cli/estimate_lines.h"
#include "scheduler/cli/farm_client.h"
#include "scheduler/cli/parse.h"
#include "scheduler/report/html.h"
#include "scheduler/store/job_state.h"
#include "schema/base/clock.h"
#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// What all asking commands are told.
struct Question {
  std::string shot, job, server, token_file, kind, state;
  int limit = 1000;
  bool json = false;
};

enum class Names { Nothing, MaybeShot, Shot, ShotAndJob };

void declare(CLI::App& app, Question& q, Names names) {
  if (names != Names::Nothing)
    app.add_option("shot", q.shot, "folder of the shot, or its name with --server")
        ->required(names != Names::MaybeShot);
  if (names == Names::ShotAndJob) app.add_option("job", q.job, "e.g. navspace or depth/cam0-000003")->required();
  app.add_option("--server", q.server, "a scheduler, e.g. http://127.0.0.1:8080; left out: the shot's own last run");
  app.add_option("--token-file", q.token_file, "file with the token that says who asks; else $VANTAGE_TOKEN");
  app.add_flag("--json", q.json, "for programs");
}

std::string seconds(const Json& ms) { return html::duration(ms.get<double>() / 1000); }

int count_where(const Json& counts, bool (*wanted)(JobState)) {
  int sum = 0;
  for (const auto& [word, n] : counts.items())
    if (const auto state = job_state_from(word); state && wanted(*state)) sum += n.get<int>();
  return sum;
}

int total(const Json& counts) {
  return count_where(counts, [](JobState) { return true; });
}

std::string counts_line(const Json& counts) {
  std::string text = fmt::format("{:>6} of {:<6} good", count_where(counts, is_good), total(counts));
  if (const int n = count_where(counts, is_active); n > 0) text += fmt::format(", {} running", n);
  if (const int n = count_where(counts, is_bad); n > 0) text += fmt::format(", {} failed", n);
  return text;
}

void print_time_left(FarmClient& client, const Json& shot) {
  const Json estimate = client.get(fmt::format("/shots/{}/estimate", shot.at("id").get<std::int64_t>()), {});
  fmt::print("  {}\n", estimate_line(shot.at("counts"), estimate, client.get("/workers", {}).at("workers"),
                                     system_clock().wall_ms()));
  if (const Json& path = estimate.at("critical_path"); !path.empty())
    fmt::print("  bound by     {} job{} one after the other ({} with free workers), now {}\n", path.size(),
               path.size() == 1 ? "" : "s", html::duration(estimate.at("critical_path_s").get<double>()),
               path.front().at("name").get<std::string>());
}

void print_shot(FarmClient& client, const Json& shot) {
  fmt::print("{}: {}  ({})\n", shot.at("name").get<std::string>(), shot.at("state").get<std::string>(),
             shot.at("folder").get<std::string>());
  if (const auto error = shot.at("error").get<std::string>(); !error.empty()) fmt::print("  {}\n", error);
  for (const auto& stage : shot.at("stages"))
    if (total(stage.at("counts")) > 0)
      fmt::print("  {:<12} {}{}\n", stage.at("kind").get<std::string>(), counts_line(stage.at("counts")),
                 stage.at("wall_ms") > 0 ? ", " + seconds(stage.at("wall_ms")) + " of work" : "");
  fmt::print("  {:<12} {}\n", "together", counts_line(shot.at("counts")));
  if (shot.at("state") == "running" || shot.at("state") == "paused") print_time_left(client, shot);
}

void print_job_line(const Json& job) {
  const std::string error = job.at("error"), reason = job.at("reason");
  fmt::print("{:<12} {:<44} {:>9}  {}\n", job.at("state").get<std::string>(), job.at("name").get<std::string>(),
             job.at("wall_ms") > 0 ? seconds(job.at("wall_ms")) : "", error.empty() ? reason : error);
}

void print_why(const Json& job) {
  fmt::print("{} is {}: {}\n", job.at("name").get<std::string>(), job.at("state").get<std::string>(),
             job.at("reason").get<std::string>().empty() ? "no reason was noted" : job.at("reason").get<std::string>());
  if (const auto waits = job.at("waits").get<std::string>(); !waits.empty()) fmt::print("  {}\n", waits);
  if (const auto error = job.at("error").get<std::string>(); !error.empty())
    fmt::print("  {}: {}\n", job.at("error_kind").get<std::string>(), error);
  for (const auto& input : job.at("inputs")) {
    const auto state = job_state_from(input.at("state").get<std::string>());
    if (!state || !is_good(*state))
      fmt::print("  waits for {} ({})\n", input.at("name").get<std::string>(), input.at("state").get<std::string>());
  }
  for (const auto& attempt : job.at("attempts"))
    fmt::print("  attempt {} on {}: {}{}, {}\n", attempt.at("number").get<int>(),
               attempt.at("worker").get<std::string>(),
               attempt.at("outcome").get<std::string>().empty() ? attempt.at("state").get<std::string>()
                                                                : attempt.at("outcome").get<std::string>(),
               attempt.at("signal") != 0 ? fmt::format(" (signal {})", attempt.at("signal").get<int>()) : "",
               seconds(attempt.at("wall_ms")));
  for (const auto& event : job.at("history"))
    fmt::print("  {}: {}\n", event.at("kind").get<std::string>(), event.at("text").get<std::string>());
  if (const auto key = job.at("key").get<std::string>(); !key.empty())
    fmt::print("  result: {} {}\n", key, job.at("artifact").get<std::string>());
  if (const auto command = job.at("reproduce").get<std::string>(); !command.empty())
    fmt::print("  by hand: {}\n", command);
}

void require_kind(const std::string& kind) {
  if (!kind.empty() && find_kind(kind) == nullptr)
    throw Error(ErrorKind::BadInput, fmt::format("--kind {}: no such stage{}", kind, did_you_mean(kind, kind_names())));
}

void require_state(const std::string& state) {
  const std::vector<std::string> words(kJobStateNames.begin(), kJobStateNames.end());
  if (!state.empty() && !job_state_from(state))
    throw Error(ErrorKind::BadInput, fmt::format("--state {}: no such state{}", state, did_you_mean(state, words)));
}

}  // namespace

int status_command(const Arguments& arguments) {
  CLI::App app{"How far a shot is; with --server and no shot, all shots.", "vantage status"};
  Question q;
  declare(app, q, Names::MaybeShot);
  parse(app, arguments);
  const auto client = make_farm_client(q.server, q.shot, q.token_file);
  const Json known =
      q.shot.empty() ? client->get("/shots", {}).at("shots") : Json{{{"id", find_shot(*client, q.shot)}}};
  Json shots = Json::array();
  for (const auto& shot : known)
    shots.push_back(client->get(fmt::format("/shots/{}", shot.at("id").get<std::int64_t>()), {}));
  if (q.json)
    fmt::print("{}\n", (q.shot.empty() ? shots : shots.at(0)).dump());
  else
    for (const auto& shot : shots) print_shot(*client, shot);
  return kExitOk;
}

int jobs_command(const Arguments& arguments) {
  CLI::App app{"Lists a shot's jobs: those at work first, then failed ones, then the newest.", "vantage jobs"};
  Question q;
  declare(app, q, Names::Shot);
  app.add_option("--kind", q.kind, "only this stage");
  app.add_option("--state", q.state, "only this state, e.g. failed");
  app.add_option("--limit", q.limit, "at most so many")->capture_default_str();
  parse(app, arguments);
  require_kind(q.kind);
  require_state(q.state);
  const auto client = make_farm_client(q.server, q.shot, q.token_file);
  const Json page = client->get(fmt::format("/shots/{}/jobs", find_shot(*client, q.shot)),
                                {{"kind", q.kind}, {"state", q.state}, {"limit", std::to_string(q.limit)}});
  if (q.json) {
    fmt::print("{}\n", page.dump());
    return kExitOk;
  }
  for (const auto& job : page.at("jobs")) print_job_line(job);
  if (!page.at("after").is_null())
    fmt::print("… {} of {} shown\n", page.at("jobs").size(), page.at("total").get<std::int64_t>());
  return kExitOk;
}

int logs_command(const Arguments& arguments) {
  CLI::App app{"Prints the log of a job's newest attempt.", "vantage logs"};
  Question q;
  declare(app, q, Names::ShotAndJob);
  parse(app, arguments);
  const auto client = make_farm_client(q.server, q.shot, q.token_file);
  const std::string log = client->log(find_job(*client, find_shot(*client, q.shot), q.job));
  fmt::print("{}", q.json
                       ? Json{{"job", q.job}, {"log", log}}.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n"
                       : log);
  return kExitOk;
}

int why_command(const Arguments& arguments) {
  CLI::App app{"Explains a job: why it waits, runs again, failed or was skipped.", "vantage why"};
  Question q;
  declare(app, q, Names::ShotAndJob);
  parse(app, arguments);
  const auto client = make_farm_client(q.server, q.shot, q.token_file);
  const Json job = client->get(fmt::format("/jobs/{}", find_job(*client, find_shot(*client, q.shot), q.job)), {});
  if (q.json)
    fmt::print("{}\n", job.dump());
  else
    print_why(job);
  return kExitOk;
}

}  // namespace vantage
