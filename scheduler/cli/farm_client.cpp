#include "scheduler/cli/farm_client.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "scheduler/api/gate.h"
#include "scheduler/api/http_library.h"
#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr time_t kPatienceS = 30;
constexpr int kNumTries = 4;
constexpr auto kFirstPause = std::chrono::milliseconds(250);  ///< doubles with every try
constexpr std::size_t kOrderKeyBytes = 16;

std::string find_token(const fs::path& shot, const fs::path& token_file) {
  if (!token_file.empty()) return read_token_file(token_file);
  if (const char* token = std::getenv("VANTAGE_TOKEN"); token != nullptr && *token != '\0') return token;
  const fs::path own = shot.empty() ? fs::path{} : operator_token_file(shot / ".vantage" / "farm");
  return !own.empty() && fs::exists(own) ? read_token_file(own) : "";
}

class RemoteFarm : public FarmClient {
 public:
  RemoteFarm(const std::string& server, const std::string& token) : server_(server), http_(server) {
    if (!http_.is_valid())
      throw Error(ErrorKind::BadInput, fmt::format("--server {}: expected http://HOST:PORT", server));
    http_.set_read_timeout(kPatienceS);
    if (!token.empty()) headers_.emplace("Authorization", "Bearer " + token);
  }
  Json get(const std::string& path, const Parameters& parameters) override {
    const httplib::Params query(parameters.begin(), parameters.end());
    return Json::parse(body_of(http_.Get("/api/v1" + path, query, headers_)));
  }
  std::string log(std::int64_t job_id) override {
    return body_of(http_.Get(fmt::format("/api/v1/jobs/{}/log", job_id), headers_));
  }
  /// Tried again when the connection breaks: by its key the scheduler knows an order that it has carried out already.
  Json post(const std::string& path, const Json& body) override {
    httplib::Headers headers = headers_;
    headers.emplace("Idempotency-Key", to_hex(random_bytes(kOrderKeyBytes)));
    auto pause = kFirstPause;
    for (int num_left = kNumTries;; pause *= 2) {
      const auto result = http_.Post("/api/v1" + path, headers, body.dump(), "application/json");
      if (result || --num_left == 0) return Json::parse(body_of(result));
      std::this_thread::sleep_for(pause);
    }
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
  httplib::Headers headers_;
};

class LocalFarm : public FarmClient {
 public:
  explicit LocalFarm(const fs::path& shot) : queries_(state_dir_of(shot)) {}
  Json get(const std::string& path, const Parameters& parameters) override {
    return answer_from_database(queries_, path, parameters);
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

std::unique_ptr<FarmClient> make_farm_client(const std::string& server, const fs::path& shot,
                                             const fs::path& token_file) {
  if (!server.empty()) return std::make_unique<RemoteFarm>(server, find_token(shot, token_file));
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
  const Json found = client.get(fmt::format("/shots/{}/jobs", shot_id), {{"name", name}}).at("jobs");
  if (!found.empty()) return found.at(0).at("id");
  const Json all = client.get(fmt::format("/shots/{}/jobs", shot_id), {{"limit", "1000"}});
  std::vector<std::string> names;
  for (const auto& job : all.at("jobs")) names.push_back(job.at("name"));
  throw NotFound(fmt::format("there is no job '{}'{}", name, did_you_mean(name, names)));
}

}  // namespace vantage
