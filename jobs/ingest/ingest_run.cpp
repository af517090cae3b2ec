#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "jobs/ingest/audio.h"
#include "jobs/ingest/footage.h"
#include "jobs/ingest/ingest_job.h"
#include "schema/base/error.h"
#include "schema/formats/footage_trim.h"
#include "schema/formats/frame_table.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr int kPreviewWidthPx = 480;

void write(const fs::path& path, const cv::Mat& picture) {
  // Measured at 1080p with a sensor's noise: 50 ms. With a level given OpenCV lets libpng try all filters for every
  // row: 86 ms at level 1, for files 16 % smaller that take 37 instead of 27 ms to read.
  const std::vector<int> options{cv::IMWRITE_PNG_STRATEGY, cv::IMWRITE_PNG_STRATEGY_RLE};
  if (!cv::imwrite(path.string(), picture, options))
    throw Error(ErrorKind::Resource, path.string() + ": cannot write the picture");
}

std::unique_ptr<Footage> open_footage(const JobContext& context) {
  std::vector<fs::path> files;
  for (const auto& [name, path] : context.sources()) files.push_back(path);
  check(!files.empty(), "split() gives every camera its footage");
  if (!context.unit().at("stills").get<bool>()) return open_video(files[0], context.scratch());
  const auto fps = context.unit().contains("fps") ? std::optional(context.unit()["fps"].get<double>()) : std::nullopt;
  return open_stills(std::move(files), fps);
}

/// What a person wants of the footage, in its own time since its first picture.
struct Trim {
  double start_s = 0, end_s = 0;
  explicit Trim(const Json& unit)
      : start_s(unit.value("trim_start_s", 0.0)),
        end_s(unit.value("trim_end_s", std::numeric_limits<double>::infinity())) {}
};

/// Pictures from start_s until end_s, as frames 0, 1, …; the others do not exist for anybody else.
struct Written {
  FrameTable table;
  FootageTrim trim;
};

/// A stamp must lie this much before a limit to count as before it: half a microsecond of ffmpeg's rounding.
constexpr double kSameTimeS = 5e-7;

Written write_frames(JobContext& context, Footage& footage) {
  Written written;
  FrameTable& table = written.table;
  table.camera = context.unit().at("camera");
  const Trim trim(context.unit());
  const fs::path artifact = context.out("frames.json").parent_path();
  const int num_promised = std::max(1, footage.num_promised());
  for (cv::Mat bgr = footage.next(); !bgr.empty(); bgr = footage.next()) {
    const double time_s = footage.last_time_s();
    if (time_s >= trim.end_s - kSameTimeS) break;
    if (time_s < trim.start_s - kSameTimeS) {
      ++written.trim.num_before;
      continue;
    }
    table.width = bgr.cols, table.height = bgr.rows;
    const fs::path path = frame_path(artifact, table.num_frames());
    write(context.out(path.lexically_relative(artifact).string()), bgr);
    table.pts_s.push_back(time_s);
    context.progress(0.95 * std::min(1.0, static_cast<double>(table.num_frames()) / num_promised), "frames");
  }
  if (table.pts_s.empty())
    throw Error(ErrorKind::BadInput,
                fmt::format("camera '{}': no picture is left between trim_start_s and trim_end_s: its footage has {} "
                            "pictures up to {:.3f} s, expected trim_start_s before that",
                            table.camera, written.trim.num_before, footage.last_time_s()));
  return written;
}

/// Times of the frames written, first one 0.
void set_times(JobContext& context, const Footage& footage, Written& written) {
  TimeStamps times = footage.times();
  FrameTable& table = written.table;
  if (!context.unit().contains("trim_end_s") && footage.is_truncated())
    context.warn(
        fmt::format("footage is truncated: {} of {} frames are used", times.pts_s.size(), footage.num_promised()));
  if (times.num_guessed > 0)
    context.warn(
        fmt::format("{} of {} frames carry no time stamp of their own: they are put evenly between the others, "
                    "at {:g} fps where there are none",
                    times.num_guessed, times.pts_s.size(), times.fps));
  const auto first = times.pts_s.begin() + written.trim.num_before;
  written.trim.start_s = *first;
  times.pts_s = {first, first + table.num_frames()};
  for (double& time : times.pts_s) time -= written.trim.start_s;
  for (const auto& gap : gaps_in(times.pts_s)) context.warn("the footage has a gap: " + gap);
  if (context.unit().contains("fps"))
    if (const std::string sentence = declare_fps(times, context.unit()["fps"]); !sentence.empty())
      context.warn(sentence);
  table.fps = times.fps;
  table.pts_s = std::move(times.pts_s);
}

void write_audio(JobContext& context, double first_picture_s, double duration_s) {
  auto rms = audio_envelope(context.sources().begin()->second, first_picture_s, context.scratch());
  if (rms.empty()) return;
  if (context.unit().contains("trim_end_s"))
    rms.resize(std::min(rms.size(), static_cast<std::size_t>(std::ceil(duration_s * kEnvelopeRateHz))));
  write_json(context.out("audio.json"), {{"rate_hz", kEnvelopeRateHz}, {"rms", rms}});
  context.figure("sound_s", static_cast<double>(rms.size()) / kEnvelopeRateHz);
}

void write_preview(JobContext& context, const FrameTable& table) {
  const fs::path artifact = context.out("frames.json").parent_path();
  cv::Mat picture = cv::imread(frame_path(artifact, table.num_frames() / 2).string());
  const double scale = std::min(1.0, static_cast<double>(kPreviewWidthPx) / picture.cols);
  cv::resize(picture, picture, {}, scale, scale, cv::INTER_AREA);
  write(context.out("preview.jpg"), picture);
}

}  // namespace

void IngestJob::run(JobContext& context, const Params&) {
  const auto footage = open_footage(context);
  Written written = write_frames(context, *footage);
  set_times(context, *footage, written);
  const FrameTable& table = written.table;
  for (const auto& sentence : footage->warnings()) context.warn(sentence);
  write_frame_table(context.out("frames.json"), table);
  if (written.trim.num_before > 0) write_footage_trim(context.out("trim.json"), written.trim);
  context.progress(0.97, "sound");
  const double duration_s = table.pts_s.back() + 1 / table.fps;
  if (!context.unit().at("stills").get<bool>())
    write_audio(context, footage->start_on_files_clock_s() + written.trim.start_s, duration_s);
  write_preview(context, table);
  context.figure("frames", table.num_frames());
  context.figure("width_px", table.width);
  context.figure("height_px", table.height);
  context.figure("fps", table.fps);
  context.figure("duration_s", duration_s);
  context.figure("footage", footage->description());
}

}  // namespace vantage
