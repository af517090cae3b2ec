#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "scheduler/api/route_table.h"
#include "schema/base/json.h"

namespace vantage {

/// The farm as the asking commands see it: a scheduler over HTTP, or the database of a shot that `vantage run` works
/// on or has worked on. Both answer the same paths with the same JSON.
class FarmClient {
 public:
  virtual ~FarmClient() = default;
  /// GET /api/v1<path>. Throws Error(BadInput) for what does not exist, Error(Transient) when nobody answers.
  virtual Json get(const std::string& path, const Parameters& parameters) = 0;
  virtual std::string log(std::int64_t job_id) = 0;
  /// POST /api/v1<path>.
  virtual Json post(const std::string& path, const Json& body) = 0;
};

/// server: "http://host:port"; empty: the database in SHOT/.vantage/farm.
/// Who we are is said with the token in token_file, else in $VANTAGE_TOKEN, else in the shot's own operator.token.
std::unique_ptr<FarmClient> make_farm_client(const std::string& server, const std::filesystem::path& shot,
                                             const std::filesystem::path& token_file = {});

/// Number of the shot, by its folder or its name. Throws Error(BadInput) with a suggestion when there is none.
std::int64_t find_shot(FarmClient& client, const std::string& shot);

/// Number of a job by its name.
std::int64_t find_job(FarmClient& client, std::int64_t shot_id, const std::string& name);

}  // namespace vantage
