#pragma once
#include <string>
#include <vector>

#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// Where every camera was, and its lens. Publishes a COLMAP text model of pinhole cameras with poses of all images, the
/// lens as filmed beside it (cameras_distorted.txt), report.json and, estimated, what was seen where
/// (observations.txt).
struct CalibrateJob {
  struct Params {
    std::string method = "colmap";
    std::string model;
    std::string lens = "SIMPLE_RADIAL";
    int plate_frames = 31;
    int feature_width_px = 1600;
    int max_features = 4096;
    int max_key_frames = 30;
    double max_reproj_error_px = 4;
    bool match_colour = true;
    std::string known_distance;
    double known_distance_m = 0;
    void fields(auto&& field) {
      field("method", method, OneOf{{"colmap", "known"}}, "colmap: from the pictures; known: from a COLMAP text model");
      field("model", model, Any{},
            "method known: folder with a COLMAP text model, or a .toml file of OpenCV cameras (Pose2Sim, Caliscope), "
            "relative to shot.toml; empty: every camera's calibration names its .chan file");
      field("lens", lens, OneOf{{"SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV"}},
            "method colmap: lens model of every camera");
      field("plate_frames", plate_frames, Range{1, 301},
            "frames whose median is a static camera's picture without moving things");
      field("feature_width_px", feature_width_px, Range{320, 8000},
            "longer side at which features are sought; small pictures are at most doubled");
      field("max_features", max_features, Range{500, 30000}, "features per picture");
      field("max_key_frames", max_key_frames, Range{3, 300},
            "pictures of a moving camera that are calibrated together; the others are placed between them");
      field("known_distance", known_distance, Any{},
            "method colmap: two cameras, or a camera and the ground, whose distance is known: \"cam0 cam3\", \"cam0 "
            "ground\"");
      field("known_distance_m", known_distance_m, Range{0, 1e5},
            "that distance in metres: all lengths are then metres; 0: the size of the world stays open");
      field("max_reproj_error_px", max_reproj_error_px, Range{0.5, 20}, "farther off, a feature is no match");
      field("match_colour", match_colour, Any{},
            "cameras whose colours differ get one look: a gain per channel and a gamma per camera");
    }
  };
  static KindSpec spec() {
    return {.name = "calibrate",
            .version = 4,
            .reads = "frames",
            .publishes = "COLMAP model: intrinsics, a pose per image, sparse points, undistortion",
            .programs = "colmap"};
  }
  /// Method known needs its model, or a .chan file per camera: throws Error(BadInput) with the line of shot.toml.
  static void check(const Shot& shot);
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
