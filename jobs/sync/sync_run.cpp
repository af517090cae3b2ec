#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

#include "jobs/sync/motion_offset.h"
#include "jobs/sync/pair_pictures.h"
#include "jobs/sync/scan_picture.h"
#include "jobs/sync/sync_job.h"
#include "jobs/vision/shot_images.h"
#include "schema/formats/matches.h"

namespace vantage {
namespace {

/// More tracks than this add time but no certainty.
constexpr std::size_t kMaxTracksPerCamera = 600;

/// Sound and motion that are farther apart contradict each other.
constexpr double kSoundFarS = 0.3;

PairOffset empty_answer(const JobContext& context, const std::string& method) {
  PairOffset offset{.a = context.unit().at("a"), .b = context.unit().at("b"), .method = method, .verdict = {}};
  return offset;
}

void publish(JobContext& context, const PairOffset& offset) {
  write_pair_offset(context.out("offset.json"), offset);
  context.figure("offset_s", offset.offset_s);
  context.figure("std_s", offset.std_s);
  context.figure("determined", offset.determined);
  context.figure("inliers", offset.num_inliers);
  context.figure("verdict", offset.verdict);
}

void run_audio(JobContext& context, const SyncJob::Params& params) {
  PairOffset offset = empty_answer(context, "audio");
  const auto a = sync::read_envelope(context.input("ingest/" + offset.a)),
             b = sync::read_envelope(context.input("ingest/" + offset.b));
  if (!a || !b)
    sync::undetermined(offset, (a ? offset.b : offset.a) + " has no sound");
  else
    sync::judge_audio(offset, sync::correlate_envelopes(*a, *b, params.max_offset_s));
  publish(context, offset);
}

sync::GreyFrames grey_frames(const JobContext& context, const Calibration& calibration, const std::string& camera) {
  std::shared_ptr<Undistorter> undistorter;
  if (calibration.cameras.contains(camera)) undistorter = std::make_shared<Undistorter>(calibration.camera(camera));
  return [folder = context.input("ingest/" + camera), undistorter](int frame) {
    cv::Mat bgr = read_picture(frame_path(folder, frame));
    if (undistorter) bgr = undistorter->apply(bgr);
    cv::Mat1b grey;
    cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
    return grey;
  };
}

/// Only what is clear enough to be an answer by itself.
std::optional<sync::AudioOffset> clear_sound(const JobContext& context, const std::string& a, const std::string& b,
                                             double max_offset_s) {
  const auto in_a = sync::read_envelope(context.input("ingest/" + a)),
             in_b = sync::read_envelope(context.input("ingest/" + b));
  if (!in_a || !in_b) return std::nullopt;
  const auto sound = sync::correlate_envelopes(*in_a, *in_b, max_offset_s);
  PairOffset judged;
  sync::judge_audio(judged, sound);
  return judged.determined ? sound : std::nullopt;
}

sync::MotionInput read_input(const JobContext& context, const std::string& a, const std::string& b) {
  const Calibration calibration = read_calibration(context.input("calibrate"));
  const bool moving_a = context.unit().at("moving_a"), moving_b = context.unit().at("moving_b");
  const auto readout_s = [&](const char* key) { return 1e-3 * context.unit().value(key, 0.0); };
  sync::MotionInput in;
  in.table_a = read_frame_table(context.input("ingest/" + a));
  in.table_b = read_frame_table(context.input("ingest/" + b));
  in.a = sync::moving_tracks(read_tracks(context.input("track/" + a)), in.table_a, kMaxTracksPerCamera,
                             readout_s("readout_ms_a"));
  in.b = sync::moving_tracks(read_tracks(context.input("track/" + b)), in.table_b, kMaxTracksPerCamera,
                             readout_s("readout_ms_b"));
  if (sync::is_calibrated(calibration, a) && sync::is_calibrated(calibration, b))
    in.geometry.emplace(sync::CameraPath(calibration, in.table_a, moving_a),
                        sync::CameraPath(calibration, in.table_b, moving_b));
  const auto lens_of = [&](const std::string& camera) {
    const bool known = calibration.cameras.contains(camera);
    return known ? std::optional(calibration.camera(camera).pinhole) : std::nullopt;
  };
  in.lens_a = lens_of(a);
  in.lens_b = lens_of(b);
  in.static_cameras = !moving_a && !moving_b;
  if (in.geometry && in.static_cameras)
    in.outlines = sync::FrontierInput{in.geometry->pencil(), read_moving_areas(context.input("track/" + a)),
                                      read_moving_areas(context.input("track/" + b))};
  in.grey_a = grey_frames(context, calibration, a);
  in.grey_b = grey_frames(context, calibration, b);
  return in;
}

/// Of a pair whose clocks stay as they are over the whole clip; else none.
std::vector<SharedTrack> shared_tracks(const sync::MotionAnswer& answer,
                                       const std::vector<sync::TimedTrack>& tracks_b) {
  if (!answer.offset.determined || answer.jump) return {};
  std::map<int, const sync::TimedTrack*> b_of;
  for (const auto& track : tracks_b) b_of[track.index] = &track;
  std::vector<SharedTrack> shared;
  for (const auto& [a, b] : answer.points) {
    const sync::TimedTrack& found = *b_of.at(b.index);
    const std::size_t last = b.size() - 1;
    shared.push_back({a.index, b.index, b.px(0) - found.px(0), b.px(last) - found.px(last)});
  }
  return shared;
}

void write_pictures(const JobContext& context, const sync::MotionInput& input, const sync::MotionAnswer& answer) {
  write_picture(context.out("preview.jpg"),
                sync::scan_picture(answer.scan, answer.offset.offset_s, answer.offset.determined));
  if (const cv::Mat matches = sync::matches_picture(input, answer); !matches.empty())
    write_picture(context.out("matches.jpg"), matches);
  if (const cv::Mat residuals = sync::residuals_picture(input, answer); !residuals.empty())
    write_picture(context.out("residuals.png"), residuals);
}

void run_motion(JobContext& context, const SyncJob::Params& params) {
  PairOffset names = empty_answer(context, "motion");
  context.progress(0.05, "reading tracks");
  sync::MotionInput input = read_input(context, names.a, names.b);
  input.sound = clear_sound(context, names.a, names.b, params.max_offset_s);
  if (!input.geometry)
    context.warn(
        fmt::format("{} or {} is not calibrated: only the ways that need no calibration are tried", names.a, names.b));
  context.progress(0.2, "finding the offset");
  sync::MotionAnswer answer = sync::offset_from_motion(input, params);
  answer.offset.a = names.a;
  answer.offset.b = names.b;
  if (answer.jump) {
    const std::string lost = sync::describe(*answer.jump, names.a, names.b);
    context.warn(lost);
    answer.offset.verdict += "; " + lost;
  }
  if (input.sound) {
    context.figure("sound_offset_s", input.sound->offset_s);
    if (answer.offset.determined && std::abs(input.sound->offset_s - answer.offset.offset_s) > kSoundFarS)
      context.warn(fmt::format("{} and {}: motion says {:+.3f} s, sound {:+.3f} s", names.a, names.b,
                               answer.offset.offset_s, input.sound->offset_s));
  }
  publish(context, answer.offset);
  if (answer.shutter && answer.offset.determined) {
    answer.shutter->a = names.a;
    answer.shutter->b = names.b;
    write_pair_shutter(context.out("shutter.json"), *answer.shutter);
  }
  write_matches(context.out("matches.json"), shared_tracks(answer, input.b));
  context.figure("matches", answer.num_matches);
  context.figure("contrast", std::min(answer.contrast, 1e3));
  for (const auto& [name, value] : answer.figures) context.figure(name, value);
  if (answer.outlines.fit) {
    context.figure("outlines_offset_s", answer.outlines.fit->offset_s);
    context.figure("outlines_std_s", answer.outlines.fit->std_s);
    context.figure("outlines_contrast", std::min(answer.outlines.scan.contrast(), 1e3));
  }
  if (answer.fit) {
    context.figure("noise_px", answer.fit->noise_px);
    context.figure("bias_px", answer.fit->bias_px);
    context.figure("effective_tracks", answer.fit->effective_tracks);
  }
  write_pictures(context, input, answer);
}

}  // namespace

void SyncJob::run(JobContext& context, const Params& params) {
  check(params.method == "motion" || params.method == "audio", "known clocks need no sync jobs");
  if (params.method == "audio")
    run_audio(context, params);
  else
    run_motion(context, params);
}

}  // namespace vantage
