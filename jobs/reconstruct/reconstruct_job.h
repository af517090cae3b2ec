#pragma once
#include "jobs/groups/image_groups.h"
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// Moving surface patches from one group of images: Klose et al. 2011, §6.
struct ReconstructJob {
  struct Params {
    int group_frames = kDefaultGroupFrames;
    int level = -1;
    int cell_px = 2;
    int max_patches = 100000;
    int iterations = 2;
    int min_views = 3;
    double min_ncc = 0.7;
    double coverage = 0.95;
    double regularity = 0.25;
    double max_speed_widths = 1.0;
    std::string optimizer = "lm";
    void fields(auto&& field) {
      field("group_frames", group_frames, Range{1, 8},
            "consecutive frames per camera in a group; motion is taken as linear over them");
      field("level", level, Range{-1, 6},
            "how often images are halved first; -1: until none is wider than 1280 pixels");
      field("cell_px", cell_px, Range{1, 16}, "distance of patches in pixels of the reduced images");
      field("max_patches", max_patches, Range{100, 2000000}, "a group stops growing at so many patches");
      field("iterations", iterations, Range{1, 10}, "rounds of growing and filtering");
      field("min_views", min_views, Range{3, 16}, "images that must agree on a patch");
      field("min_ncc", min_ncc, Range{0.3, 0.99}, "least mean correlation of a patch's images");
      field("coverage", coverage, Range{0.01, 1.0}, "stop growing when this share of the textured cells is covered");
      field("regularity", regularity, Range{0.0, 1.0},
            "least share of neighbouring patches that must lie on the same surface (z of Eq. 9)");
      field("max_speed_widths", max_speed_widths, Range{0.0, 10.0}, "fastest motion, in image widths per second");
      field("optimizer", optimizer, OneOf{{"lm", "lbfgs", "nlcg"}},
            "Levenberg-Marquardt, L-BFGS, or the paper's nonlinear conjugate gradients");
    }
  };
  static KindSpec spec() {
    return {.name = "reconstruct",
            .version = 2,
            .reads = "images of a group, poses, times",
            .publishes = "patches: position, normal, velocity, colour, visibility"};
  }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
