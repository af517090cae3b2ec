#include "jobs/job_context.h"

#include "schema/base/error.h"

namespace vantage {

JobContext::JobContext(Config config) : config_(std::move(config)) {}

const std::filesystem::path& JobContext::input(const std::string& job_name) const {
  const auto found = config_.inputs.find(job_name);
  check(found != config_.inputs.end(), "a job reads only what its split declared: input " + job_name);
  return found->second;
}

const std::filesystem::path& JobContext::source(const std::string& name) const {
  const auto found = config_.sources.find(name);
  check(found != config_.sources.end(), "a job reads only what its split declared: source " + name);
  return found->second;
}

std::filesystem::path JobContext::out(const std::string& relative) const {
  const std::filesystem::path path = config_.out_dir / relative;
  std::filesystem::create_directories(path.parent_path());
  return path;
}

const std::filesystem::path& JobContext::scratch() const {
  std::filesystem::create_directories(config_.scratch_dir);
  return config_.scratch_dir;
}

void JobContext::progress(double fraction, const std::string& phase) {
  if (config_.on_progress) config_.on_progress(fraction, phase);
}

}  // namespace vantage
