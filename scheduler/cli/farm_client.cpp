#include "scheduler/cli/farm_client.h"

#include <fmt/format.h>
#include <httplib.h>

#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr time_t kPatienceS = 30;

class RemoteFarm : public FarmClient {
 public:
  explicit RemoteFarm(const std::string& server) : server_(server), http_(server) {
    if (!http_.is_valid())
      throw Error(ErrorKind::BadInput, fmt::format("--server {}: expected http://HOST:PORT", server));
    http_.set_read_timeout(kPatienceS);
  }
  Json get(const std::string& path, const Parameters& parameters) override {
    const httplib::Params query(parameters.begin(), parameters.end());
    return Json::parse(body_of(http_.Get("/api/v1" + path, query, httplib::Headers{})));
  }
  std::string log(std::int64_t job_id) override {
    return body_of(http_.Get(fmt::format("/api/v1/jobs/{}/log", job_id)));
  }
  Json post(const std::string& path, const Json& body) override {
    return Json::parse(
        body_of(http_.Post("/api/v1" + path, httplib::Headers{{"X-Vantage", "1"}}, body.dump(), "application/json")));
  }

 private:
  std::string body_of(const httplib::Result& result) const {
    if (!result)
      throw Error(ErrorKind::Transient,
                  fmt::format("{} does not answer: {}", server_, httplib::to_string(result.error())));
    if (result->status == 200) return result->body;
    const Json answer = Json::parse(result->body, nullptr, false);
    const std::string why =
        answer.is_object() ? answer.value("error", "") : fmt::format("HTTP status {}", result->status);
    throw Error(result->status < 500 ? ErrorKind::BadInput : ErrorKind::Transient, why);
  }

  std::string server_;
  httplib::Client http_;
};

class LocalFarm : public FarmClient {
 public:
  explicit LocalFarm(const fs::path& shot) : queries_(state_dir_of(shot)) {}
  Json get(const std::string& path, const Parameters& parameters) override {
    return api_get(queries_, path, parameters);
  }
  std::string log(std::int64_t job_id) override {
    const fs::path log = queries_.log_path(job_id);
    if (log.empty() || !fs::exists(log)) throw NotFound("the job has no log yet");
    return read_file(log);
  }
  Json post(const std::string&, const Json&) override {
    throw Error(
        ErrorKind::BadInput,
        "only a scheduler can do that: say --server http://HOST:PORT (vantage run prints its address as 'Page')");
  }

 private:
  static fs::path state_dir_of(const fs::path& shot) {
    if (shot.empty())
      throw Error(ErrorKind::BadInput, "name a shot's folder, or a scheduler with --server http://HOST:PORT");
    if (!fs::is_directory(shot))
      throw Error(ErrorKind::BadInput, fmt::format("{}: no such shot folder", shot.string()));
    const fs::path state_dir = shot / ".vantage" / "farm";
    if (!fs::exists(state_dir / "farm.sqlite"))
      throw Error(ErrorKind::BadInput, fmt::format("{0}: has not been run yet; 'vantage run {0}' does", shot.string()));
    return state_dir;
  }

  FarmQueries queries_;
};

}  // namespace

std::unique_ptr<FarmClient> make_farm_client(const std::string& server, const fs::path& shot) {
  if (!server.empty()) return std::make_unique<RemoteFarm>(server);
  return std::make_unique<LocalFarm>(shot);
}

std::int64_t find_shot(FarmClient& client, const std::string& shot) {
  const Json shots = client.get("/shots", {}).at("shots");
  std::error_code none;
  const fs::path wanted = fs::weakly_canonical(shot, none);
  std::vector<std::string> names;
  for (const auto& candidate : shots) {
    const fs::path folder = candidate.at("folder").get<std::string>();
    if (fs::weakly_canonical(folder, none) == wanted || candidate.at("name") == shot) return candidate.at("id");
    names.push_back(candidate.at("name"));
  }
  throw NotFound(fmt::format("the farm has no shot '{}'{}", shot, did_you_mean(shot, names)));
}

std::int64_t find_job(FarmClient& client, std::int64_t shot_id, const std::string& name) {
  const Json page = client.get(fmt::format("/shots/{}/jobs", shot_id), {{"text", name}, {"limit", "1000"}});
  for (const auto& job : page.at("jobs"))
    if (job.at("name") == name) return job.at("id");
  const Json all = client.get(fmt::format("/shots/{}/jobs", shot_id), {{"limit", "1000"}});
  std::vector<std::string> names;
  for (const auto& job : all.at("jobs")) names.push_back(job.at("name"));
  throw NotFound(fmt::format("there is no job '{}'{}", name, did_you_mean(name, names)));
}

}  // namespace vantage
