#pragma once
/// Depth of one image from the correspondences of its edges: Klose et al. 2011, §5.2.
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// Two jobs an image. "depth/cam0-000003/single" publishes single.exr: what the image's own edges tell. unit: {"image":
/// label, "edges": [{"other": label, "job": correspond job, "forward": bool, "lag_s": s, "step": {…}}]}, lag_s being
/// the image's shot time minus that of `other`; step as an edge, from `other` to the next or previous frame of its
/// camera, with "duration_s" in place of lag_s: how far things in `other` move in that time. "depth/cam0-000003"
/// publishes depth.exr (0 where unknown) and preview.jpg: the singles of the image and of the camera's frames before
/// and after it, where these have one, and the picture. unit: {"image": label, "single": job, "frames": [{"other":
/// label, "job": correspond job, "forward": bool, "single": job}]}.
struct DepthJob {
  struct Params {
    double max_epipolar_px = 1.5;
    double min_angle_deg = 1;
    double agreement_percent = 1.5;
    double max_gap_percent = 0.3;
    void fields(auto&& field) {
      field("max_epipolar_px", max_epipolar_px, Range{0.05, 100},
            "correspondences farther from their epipolar line are not used");
      field("min_angle_deg", min_angle_deg, Range{0.01, 45}, "smallest angle between the two rays to a point");
      field("agreement_percent", agreement_percent, Range{0.01, 50},
            "depths from two edges agree when they differ by no more");
      field("max_gap_percent", max_gap_percent, Range{0, 100},
            "unknown spots of up to this share of the picture are filled from their farther side; 0: none");
    }
  };
  static KindSpec spec() {
    return {
        .name = "depth", .version = 5, .reads = "correspondences of an image, poses", .publishes = "depth, confidence"};
  }
  /// With [depth]: every image with an edge to another viewpoint. Else those whose depth renders read.
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
