#include "scheduler/cli/shot_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "jobs/all_jobs.h"
#include "scheduler/cli/programs.h"
#include "schema/base/error.h"
#include "schema/formats/views_file.h"

namespace vantage {
namespace {

// Seconds on one core per picture of one megapixel, measured on 8 cameras x 24 frames of 640 x 360 pixels.
constexpr double kIngestS = 0.15, kTrackS = 0.3, kCorrespondS = 5, kDepthS = 2, kRenderS = 5, kReconstructS = 5;
constexpr double kCalibrateCameraS = 2, kSyncPairS = 1, kSmallJobS = 0.2, kEncodeFrameS = 0.08, kFuseGroupS = 1.3;
// Edges per image of a plane's Delaunay triangulation: cameras mostly stand on an arc, so that azimuth and time vary.
// The rim has fewer than the 3 of an endless plane.
constexpr double kEdgesPerImage = 2.7;
constexpr double kGroupsPerFrame = 0.6;

FootageFacts facts_of(const ShotCamera& camera, const Json& probe) {
  FootageFacts facts{
      .camera = camera.name, .footage = camera.footage, .warnings = {}, .error = probe.value("error", "")};
  if (!facts.error.empty()) return facts;
  facts.width = probe.at("width");
  facts.height = probe.at("height");
  facts.fps = probe.value("is_stills", false) ? camera.fps.value_or(1) : probe.at("fps").get<double>();
  facts.num_frames = probe.at("num_frames");
  facts.duration_s = probe.at("duration_s");
  facts.warnings = probe.value("warnings", std::vector<std::string>{});
  for (const auto& [key, value] :
       {std::pair("mask", camera.mask), {"key_color", camera.key_color}, {"calibration", camera.calibration}})
    if (!value.empty()) facts.warnings.push_back(fmt::format("'{}' is read but no stage uses it yet", key));
  return facts;
}

double num_output_frames(const Shot& shot, const RenderRequest& render) {
  if (!render.views.empty()) return static_cast<double>(read_views_file(shot.folder / render.views).views.size());
  return std::floor(render.keyframes.back().at_s * render.fps) + 1;
}

}  // namespace

Shot read_checked_shot(const std::filesystem::path& folder) {
  Shot shot = read_shot(folder, kind_names());
  for (const auto& kind : all_kinds()) kind.check(shot);
  for (const auto& render : shot.renders)
    if (!render.views.empty()) read_views_file(shot.folder / render.views);
  return shot;
}

std::vector<FootageFacts> probe_shot(const Shot& shot) {
  std::vector<std::string> footage;
  for (const auto& camera : shot.cameras) footage.push_back((shot.folder / camera.footage).string());
  const Json probes = probe_footage_files(footage);
  std::vector<FootageFacts> facts;
  for (std::size_t i = 0; i < shot.cameras.size(); ++i) facts.push_back(facts_of(shot.cameras[i], probes.at(i)));
  return facts;
}

void require_usable(const std::vector<FootageFacts>& footage) {
  for (const auto& f : footage)
    if (!f.error.empty()) throw Error(ErrorKind::BadInput, fmt::format("camera '{}': {}", f.camera, f.error));
}

std::vector<StageEstimate> estimate_plan(const Shot& shot, const std::vector<FootageFacts>& footage) {
  const double num_cameras = static_cast<double>(shot.cameras.size());
  double num_images = 0, megapixels = 0, longest = 0;
  for (const auto& f : footage) {
    num_images += f.num_frames;
    megapixels += 1e-6 * f.width * f.height * f.num_frames;
    longest = std::max<double>(longest, f.num_frames);
  }
  const double mpx = num_images > 0 ? megapixels / num_images : 0;
  const bool moves = longest > 1;
  const bool known_clocks = shot.text("sync", "method", "motion") == "known" || !moves;
  const bool known_cameras = shot.text("calibrate", "method", "colmap") == "known";
  const bool wants_model = shot.has_section("reconstruct"), wants_depth = shot.has_section("depth");
  const double num_edges = num_images * kEdgesPerImage;
  double num_frames = 0;
  for (const auto& render : shot.renders) num_frames += num_output_frames(shot, render);
  const double num_renders = static_cast<double>(shot.renders.size());
  const double num_pairs = known_clocks ? 0 : num_cameras * (num_cameras - 1) / 2;
  const double num_groups = wants_model ? std::max(1.0, std::ceil(kGroupsPerFrame * longest)) : 0;
  const bool wants_flow = wants_depth || num_frames > 0;
  std::vector<StageEstimate> stages{
      {"ingest", num_cameras, megapixels * kIngestS},
      {"calibrate", 1, known_cameras ? kSmallJobS : num_cameras * std::max(mpx, 1.0) * kCalibrateCameraS},
      {"track", known_clocks ? 0 : num_cameras, known_clocks ? 0 : megapixels * kTrackS},
      {"sync", num_pairs, num_pairs * kSyncPairS},
      {"align", 1, kSmallJobS},
      {"navspace", 1, kSmallJobS},
      {"correspond", wants_flow ? num_edges : 0, wants_flow ? num_edges * mpx * kCorrespondS : 0},
      {"depth", wants_depth ? num_images : 0, wants_depth ? megapixels * kDepthS : 0},
      {"render", num_frames, num_frames * mpx * kRenderS},
      {"encode", num_renders, num_frames * kEncodeFrameS},
      {"reconstruct", num_groups, wants_model ? megapixels * kReconstructS : 0},
      {"fuse", wants_model ? 1.0 : 0.0, num_groups * kFuseGroupS},
  };
  std::erase_if(stages, [](const StageEstimate& s) { return s.num_jobs == 0; });
  return stages;
}

}  // namespace vantage
