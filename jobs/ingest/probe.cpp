#include "jobs/ingest/probe.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "jobs/ingest/footage.h"
#include "jobs/ingest/ingest_job.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// A folder that goes away with this object.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_(fs::temp_directory_path() / fmt::format("vantage-probe-{}", getpid())) {
    fs::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

FootageProbe probe_stills(const std::vector<fs::path>& files) {
  const cv::Mat first = open_stills(files, std::nullopt)->next();
  FootageProbe out;
  out.width = first.cols, out.height = first.rows, out.fps = kDefaultStillsFps;
  out.num_frames = static_cast<int>(files.size());
  out.duration_s = out.num_frames / out.fps;
  out.is_stills = true;
  if (out.num_frames > 1)
    out.warnings.push_back(fmt::format("pictures carry no frame rate: {:g} fps is assumed; declare fps", out.fps));
  return out;
}

FootageProbe probe_video(const fs::path& file) {
  const TemporaryFolder scratch;
  const auto video = open_video(file, scratch.path());
  const cv::Mat first = video->next();
  const auto packets_s = packet_times_s(file, scratch.path());
  FootageProbe out;
  out.warnings = video->warnings();
  out.width = first.cols, out.height = first.rows, out.fps = video->times().fps;
  const int promised = video->num_promised(), present = static_cast<int>(packets_s.size());
  out.num_frames = present > 0 ? present : promised;
  out.duration_s = present > 0 ? packets_s.back() + 1 / out.fps : promised / out.fps;
  if (present > 0 && present + 1 < promised && out.duration_s + 1 / out.fps < promised / out.fps)
    out.warnings.push_back(fmt::format("footage is truncated: about {} of {} frames are there", present, promised));
  if (!has_constant_rate(packets_s)) out.warnings.emplace_back("the frame rate varies: time stamps are used");
  if (present == 0)
    out.warnings.push_back(fmt::format("the file carries no time stamps: {:g} fps is assumed", out.fps));
  return out;
}

}  // namespace

FootageProbe probe_footage(const std::string& path_or_glob) {
  const auto files = footage_files({}, path_or_glob);
  if (files.empty()) throw Error(ErrorKind::BadInput, fmt::format("{}: there is no such footage", path_or_glob));
  if (files.size() > 1 && !std::all_of(files.begin(), files.end(), is_still))
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: matches {} files that are not all pictures; expected pictures or one video",
                            path_or_glob, files.size()));
  return is_still(files[0]) ? probe_stills(files) : probe_video(files[0]);
}

}  // namespace vantage
