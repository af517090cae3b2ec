#pragma once
#include <filesystem>
#include <string>

namespace vantage {

struct ExportOptions {
  std::filesystem::path shot, to;
  double time_s = 0;  ///< of the cloud: every camera's image nearest to it
  std::string image;  ///< of the mesh, "cam0-000003"; empty: the cloud
  float min_confidence = 0.2F;
};

/// `vantage-worker points SHOT --time-s T --to FILE.ply` and `vantage-worker mesh SHOT --image I --to FILE.ply|obj`:
/// surfaces from a finished shot's depth maps, in the world of out/calibration. Says what was written; returns 0.
/// Throws Error(BadInput) when there is no such depth map, or nothing that cameras agree on.
int run_export_command(const ExportOptions& options);

}  // namespace vantage
