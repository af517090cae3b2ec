#include "jobs/calibrate/colour_match.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "jobs/calibrate/colour_solve.h"
#include "jobs/calibrate/plate.h"
#include "jobs/vision/camera_mask.h"
#include "jobs/vision/shot_images.h"

namespace vantage {
namespace {

constexpr int kPlateFrames = 9;  // enough that most of what moves is gone
constexpr int kMovingPictures = 5;

std::vector<int> placed_frames(const Calibration& calibration, const FilmedCamera& camera) {
  std::vector<int> frames;
  for (int frame = 0; frame < camera.table.num_frames(); ++frame)
    if (calibration.cam_from_world.contains({camera.table.camera, frame})) frames.push_back(frame);
  return frames;
}

/// A static camera's plate, or some frames of a moving one.
void add_pictures(const JobContext& context, const Calibration& calibration, const FilmedCamera& camera, int index,
                  std::vector<PosedColourPicture>& pictures) {
  const std::string& name = camera.table.camera;
  const auto placed = placed_frames(calibration, camera);
  if (placed.empty()) return;
  const CameraModel& model = calibration.camera(name);
  const Undistorter undistorter(model);
  const CameraMask mask(context, camera.table);
  const auto add = [&](const std::vector<int>& frames) {
    std::vector<cv::Mat> bgr;
    for (const int frame : frames) bgr.push_back(read_picture(frame_path(context.input("ingest/" + name), frame)));
    const cv::Mat1b counts = mask.of_plate(frames);
    pictures.push_back({.camera = index,
                        .bgr = undistorter.apply(median_plate(bgr)),
                        .counts = counts.empty() ? counts : undistorter.apply_mask(counts),
                        .pinhole = model.pinhole,
                        .cam_from_world = calibration.pose({name, frames.front()})});
  };
  std::vector<int> frames;
  for (const int k : spread_frames(static_cast<int>(placed.size()), camera.moving ? kMovingPictures : kPlateFrames))
    frames.push_back(placed[static_cast<std::size_t>(k)]);
  if (!camera.moving) return add(frames);
  for (const int frame : frames) add({frame});
}

}  // namespace

void match_colour(JobContext& context, const Calibration& calibration, const std::vector<FilmedCamera>& cameras) {
  context.progress(0.97, "colours");
  std::vector<PosedColourPicture> pictures;
  for (std::size_t c = 0; c < cameras.size(); ++c)
    add_pictures(context, calibration, cameras[c], static_cast<int>(c), pictures);
  ColourSolution solution = solve_colours(colour_samples(pictures), static_cast<int>(cameras.size()));
  double largest = 0;
  std::string not_compared;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const std::string& name = solution.colours[c].name = cameras[c].table.camera;
    if (!solution.is_compared(c) && calibration.cameras.contains(name))
      not_compared += (not_compared.empty() ? "" : ", ") + name;
    for (const double gain : solution.colours[c].gain) largest = std::max(largest, std::abs(gain - 1));
  }
  if (!not_compared.empty())
    context.warn(fmt::format("colours of {} stay as filmed: fewer than {} places are found again by their neighbours",
                             not_compared, kFewSamples));
  context.figure("colour_gain_max_percent", 100 * largest);
  context.figure("colour_residual_percent", 100 * solution.residual);
  if (solution.is_significant()) write_colours(context.out("colour.json"), solution.colours);
}

}  // namespace vantage
