#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "schema/formats/calibration.h"

namespace vantage {

/// One view of a views.json: a match-moved camera. Stereo: the middle camera and the distance of the eyes.
struct ExplicitView {
  int frame = 0;      ///< number in render/<name>/frame.%06d.*
  double time_s = 0;  ///< on the shot's clock
  Pinhole pinhole;
  RigidTransform cam_from_world;
  std::optional<double> baseline;  ///< world units
};

/// A true pose of one of the shot's cameras in the views' world, to tie that world to the calibration's.
struct Anchor {
  ImageId image;
  RigidTransform cam_from_world;
};

struct ViewsFile {
  std::vector<ExplicitView> views;
  std::vector<Anchor> anchors;  ///< empty: the views are in the calibration's own world
};

/// Throws Error(BadInput) naming the file and the view that is wrong.
ViewsFile read_views_file(const std::filesystem::path& path);

}  // namespace vantage
