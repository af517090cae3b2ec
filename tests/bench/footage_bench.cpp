/// Ingest and track of one camera's 1080p footage at 30 frames a second, 8-bit H.264 with a sensor's noise: what a
/// phone on a tripod delivers. Prints one JSON line: CPU seconds and wall time per camera-minute, and peak memory.
/// footage_bench [SECONDS]: length of the footage that is made, default 10.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <functional>

#include "jobs/ingest/ingest_job.h"
#include "jobs/track/track_job.h"
#include "schema/base/error.h"
#include "schema/base/program.h"
#include "schema/formats/calibration.h"
#include "schema/formats/frame_table.h"
#include "schema/formats/tracks.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

constexpr double kFps = 30;

void make_footage(const fs::path& file, double seconds) {
  // A textured background under noise that changes from frame to frame, and things that move over it.
  const std::string still = fmt::format("mandelbrot=s=1920x1080:r={}:maxiter=200:end_scale=0.3:end_pts=1000000", kFps);
  const std::string moving = fmt::format("testsrc2=s=480x270:r={}", kFps);
  const int status =
      run_program({"ffmpeg",
                   "-v",
                   "error",
                   "-nostdin",
                   "-y",
                   "-f",
                   "lavfi",
                   "-i",
                   still,
                   "-f",
                   "lavfi",
                   "-i",
                   moving,
                   "-filter_complex",
                   "[0]select='eq(n,0)',loop=-1:1,setpts=N/30/TB[b];[b][1]overlay=x='300+200*sin(t)':y='200+20*t',"
                   "noise=alls=6:allf=t",
                   "-t",
                   fmt::format("{}", seconds),
                   "-c:v",
                   "libx264",
                   "-preset",
                   "veryfast",
                   "-crf",
                   "20",
                   "-pix_fmt",
                   "yuv420p",
                   "-r",
                   "30",
                   file.string()},
                  {});
  check(status == 0, "ffmpeg makes the footage");
}

/// What work() and the programs that it starts cost, run in a process of its own.
Json cost_per_minute(double seconds, const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  const pid_t pid = fork();
  if (pid == 0) {
    work();
    _exit(0);
  }
  int status = 0;
  rusage used{};
  wait4(pid, &status, 0, &used);
  check(status == 0, "the job ends well");
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto seconds_of = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return {{"cpu_s_per_minute", 60 / seconds * (seconds_of(used.ru_utime) + seconds_of(used.ru_stime))},
          {"wall_s_per_minute", 60 / seconds * wall_s},
          {"peak_mb", used.ru_maxrss / 1024}};
}

JobContext context_of(const fs::path& folder, const std::string& kind, JobContext::Config config) {
  config.out_dir = folder / kind;
  config.scratch_dir = folder / "scratch" / kind;
  fs::create_directories(config.out_dir);
  return JobContext(config);
}

Json measure(double seconds) {
  const TemporaryFolder folder;
  const fs::path footage = folder.path() / "cam0.mp4", calibrate = folder.path() / "calibrate";
  make_footage(footage, seconds);
  Calibration calibration;
  calibration.cameras["cam0"] = {.name = "cam0", .id = 1, .pinhole = {1920, 1080, 1500, 1500, 960, 540}, .filmed = {}};
  calibration.cam_from_world[{"cam0", 0}] = {};
  fs::create_directories(calibrate);
  write_calibration(calibrate, calibration);
  const Json ingest = cost_per_minute(seconds, [&] {
    auto context = context_of(folder.path(), "ingest",
                              {.unit = {{"camera", "cam0"}, {"stills", false}},
                               .inputs = {},
                               .sources = {{"footage/000000", footage}},
                               .out_dir = {},
                               .scratch_dir = {},
                               .on_progress = {}});
    IngestJob::run(context, {});
  });
  const Json track = cost_per_minute(seconds, [&] {
    auto context = context_of(folder.path(), "track",
                              {.unit = {{"camera", "cam0"}, {"moving", false}},
                               .inputs = {{"ingest/cam0", folder.path() / "ingest"}, {"calibrate", calibrate}},
                               .sources = {},
                               .out_dir = {},
                               .scratch_dir = {},
                               .on_progress = {}});
    TrackJob::run(context, {});
  });
  const int num_frames = read_frame_table(folder.path() / "ingest").num_frames();
  return {{"bench", "footage"},
          {"seconds", seconds},
          {"frames", num_frames},
          {"frames_expected", std::lround(seconds * kFps)},
          {"tracks", read_tracks(folder.path() / "track").tracks.size()},
          {"ingest", ingest},
          {"track", track}};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 10;
  fmt::print("{}\n", vantage::measure(seconds).dump());
}
