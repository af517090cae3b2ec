#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vantage {

/// Cells of one row of a frame, [begin, end), that hold something in motion.
struct MovingRun {
  std::uint16_t row = 0, begin = 0, end = 0;
  bool operator==(const MovingRun&) const = default;
};

/// moving.bin of a track artifact: where things were in motion at the moment of each frame, on a grid of square cells.
/// Cell (column, row) covers the undistorted pixels [column, column + 1) · cell_px by [row, row + 1) · cell_px.
/// A frame whose motion is not known (the first and last) has no runs; a moving camera has no frames.
struct MovingAreas {
  std::string camera;
  int cell_px = 1, columns = 0, rows = 0;
  std::vector<std::vector<MovingRun>> frames;  ///< by frame number; runs from top to bottom, left to right
};

/// Binary, little-endian: "VMOV", u32 version (1), u32 length and bytes of the camera's name, i32 cell_px, i32 columns,
/// i32 rows, u32 frames; per frame: u32 runs, runs × {u16 row, u16 begin, u16 end}.
void write_moving_areas(const std::filesystem::path& file, const MovingAreas& areas);
/// Reads track_artifact/moving.bin. Throws Error(BadInput) for a truncated or foreign file.
MovingAreas read_moving_areas(const std::filesystem::path& track_artifact);

}  // namespace vantage
