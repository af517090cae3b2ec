#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "schema/base/json.h"

namespace vantage {

/// All that a running job knows of the farm. Made by the worker's child process; tests make one by hand.
/// One thread uses it.
class JobContext {
 public:
  struct Config {
    Json unit = Json::object();
    std::map<std::string, std::filesystem::path> inputs;   ///< artifact folder by job name
    std::map<std::string, std::filesystem::path> sources;  ///< file by source name
    std::filesystem::path out_dir;                         ///< private; becomes the artifact when run() returns
    std::filesystem::path scratch_dir;                     ///< private; made when asked for, deleted afterwards
    int cores = 1;
    std::function<void(double fraction, const std::string& phase)> on_progress;
  };
  explicit JobContext(Config config);

  /// The WorkUnit's unit.
  const Json& unit() const { return config_.unit; }
  /// Artifact folder of a needed job. Throws Error(Bug) when the job did not declare it.
  const std::filesystem::path& input(const std::string& job_name) const;
  bool has_input(const std::string& job_name) const { return config_.inputs.contains(job_name); }
  const std::map<std::string, std::filesystem::path>& inputs() const { return config_.inputs; }
  /// File from outside. Throws Error(Bug) when the job did not declare it.
  const std::filesystem::path& source(const std::string& name) const;
  const std::map<std::string, std::filesystem::path>& sources() const { return config_.sources; }

  /// Where to write a file of the artifact; its folder is made.
  std::filesystem::path out(const std::string& relative) const;
  /// A folder for what nobody needs afterwards.
  const std::filesystem::path& scratch() const;
  int cores() const { return config_.cores; }

  /// fraction in [0, 1]; cheap, call it often.
  void progress(double fraction, const std::string& phase);
  /// A figure that people see beside the job and in the report, e.g. figure("inliers", 812).
  /// Part of the manifest but not of the artifact's content hash: never read by another job.
  void figure(const std::string& name, Json value) { figures_[name] = std::move(value); }
  /// A sentence people should read, e.g. "footage is truncated: 212 of 240 frames are used".
  void warn(const std::string& sentence) { figures_["warnings"].push_back(sentence); }
  const Json& figures() const { return figures_; }

 private:
  Config config_;
  Json figures_ = Json::object();
};

}  // namespace vantage
