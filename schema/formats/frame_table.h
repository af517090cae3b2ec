#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace vantage {

/// frames.json of an ingest artifact: the pictures of one camera. Picture k is frames/<k:06d>.png, 8-bit BGR as OpenCV
/// reads it, in the footage's own pixels (not undistorted).
struct FrameTable {
  std::string camera;
  int width = 0, height = 0;
  double fps = 0;             ///< nominal; the time stamps are the truth
  std::vector<double> pts_s;  ///< presentation time of each frame since the first one; rising
  int num_frames() const { return static_cast<int>(pts_s.size()); }
};

FrameTable read_frame_table(const std::filesystem::path& ingest_artifact);
void write_frame_table(const std::filesystem::path& file, const FrameTable& table);
/// Path of a picture inside an ingest artifact.
std::filesystem::path frame_path(const std::filesystem::path& ingest_artifact, int frame);

}  // namespace vantage
