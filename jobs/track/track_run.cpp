#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "jobs/track/follow.h"
#include "jobs/track/looks.h"
#include "jobs/track/motion_recorder.h"
#include "jobs/track/track_job.h"
#include "jobs/vision/camera_mask.h"
#include "jobs/vision/shot_images.h"

namespace vantage {
namespace {

constexpr int kPreviewWidth = 480;

/// Undistorted where the camera is calibrated, else as filmed.
cv::Mat picture_of(const JobContext& context, const Undistorter* undistorter, const std::string& camera, int frame) {
  const cv::Mat bgr = read_picture(frame_path(context.input("ingest/" + camera), frame));
  return undistorter ? undistorter->apply(bgr) : bgr;
}

/// The last second or so of every track that reaches the frame: moving ones orange, others grey.
cv::Mat draw_tracks(const cv::Mat& bgr, const std::vector<Track>& tracks, int frame, int tail_frames) {
  cv::Mat picture = bgr / 2;
  for (const bool moving : {false, true})
    for (const Track& track : tracks) {
      if (track.moving != moving || frame < track.first_frame || frame > track.last_frame()) continue;
      const cv::Scalar colour = moving ? cv::Scalar(0, 160, 255) : cv::Scalar(170, 170, 170);
      const int first = std::max(track.first_frame, frame - tail_frames);
      std::vector<cv::Point> path;
      for (int f = first; f <= frame; ++f) {
        const auto& px = track.px[static_cast<std::size_t>(f - track.first_frame)];
        path.emplace_back(cvRound(px.x() * 8 - 4), cvRound(px.y() * 8 - 4));
      }
      cv::polylines(picture, path, false, colour, 1, cv::LINE_AA, 3);
      cv::circle(picture, path.back(), 12, colour, cv::FILLED, cv::LINE_AA, 3);
    }
  const double scale = std::min(1.0, static_cast<double>(kPreviewWidth) / picture.cols);
  cv::resize(picture, picture, {}, scale, scale, cv::INTER_AREA);
  return picture;
}

track::FollowOptions options_from(const TrackJob::Params& p, bool camera_moves) {
  return {p.window_px,  p.max_forward_backward_px, p.max_background, p.max_moving,
          p.min_frames, p.min_motion_px,           camera_moves};
}

}  // namespace

void TrackJob::run(JobContext& context, const Params& params) {
  const std::string camera = context.unit().at("camera");
  const FrameTable table = read_frame_table(context.input("ingest/" + camera));
  const Calibration calibration = read_calibration(context.input("calibrate"));
  std::optional<Undistorter> undistorter;
  if (calibration.cameras.contains(camera))
    undistorter.emplace(calibration.camera(camera));
  else
    context.warn(camera + " is not calibrated: its tracks are in the footage's own pixels");

  const auto bgr = [&](int frame) { return picture_of(context, undistorter ? &*undistorter : nullptr, camera, frame); };
  const bool camera_moves = context.unit().at("moving");
  const CameraMask mask(context, table);
  const track::FrameMasks counts = [&](int frame) {
    if (!mask.exists() || !undistorter) return mask.at(frame);
    return undistorter->apply_mask(mask.at(frame));
  };
  track::MotionRecorder recorder(camera, table.fps);
  const track::GreyFrames grey = [&](int frame) {
    const cv::Mat picture = bgr(frame);
    if (!camera_moves && frame == recorder.next_frame()) recorder.add(picture, counts(frame));  // read once for both
    cv::Mat1b out;
    cv::cvtColor(picture, out, cv::COLOR_BGR2GRAY);
    return out;
  };
  TrackSet set{.camera = camera, .width = table.width, .height = table.height, .tracks = {}};
  set.tracks = track::follow_features(
      table.num_frames(), grey, options_from(params, camera_moves),
      [&](double done) { context.progress(0.9 * done, "following points"); }, counts);
  context.progress(0.9, "describing points");
  track::describe_moving_tracks(set.tracks, table.num_frames(), grey);
  write_tracks(context.out("tracks.bin"), set);
  write_moving_areas(context.out("moving.bin"), recorder.finish());

  const int middle = table.num_frames() / 2;
  write_picture(context.out("preview.jpg"), draw_tracks(bgr(middle), set.tracks, middle, 15));
  const auto num_moving = std::count_if(set.tracks.begin(), set.tracks.end(), [](const Track& t) { return t.moving; });
  context.figure("tracks", set.tracks.size());
  context.figure("moving_tracks", num_moving);
  if (num_moving == 0) context.warn(camera + ": nothing that moves could be followed");
}

}  // namespace vantage
