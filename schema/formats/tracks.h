#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vantage {

/// How a track's point looks in one frame: an upright SIFT descriptor.
struct TrackLook {
  int frame = 0;
  std::array<std::uint8_t, 128> descriptor{};
};

/// One surface point followed through consecutive frames of one camera.
struct Track {
  int first_frame = 0;
  std::vector<Eigen::Vector2f> px;  ///< undistorted pixels, centres at +0.5; px[k] belongs to frame first_frame + k
  bool moving = false;              ///< moves against the static scene
  float motion_px = 0;              ///< extent of that motion
  std::vector<TrackLook> looks;     ///< moving tracks: a few frames, rising
  int last_frame() const { return first_frame + static_cast<int>(px.size()) - 1; }
};

/// tracks.bin of a track artifact.
struct TrackSet {
  std::string camera;
  int width = 0, height = 0;  ///< of the undistorted pictures
  std::vector<Track> tracks;
};

/// Binary, little-endian: "VTRK", u32 version (1), u32 length and bytes of the camera's name, i32 width, i32 height,
/// u32 tracks; per track: i32 first_frame, u32 points, u32 looks, u8 moving, f32 motion_px, points × {f32 x, f32 y},
/// looks × {i32 frame, 128 × u8}.
void write_tracks(const std::filesystem::path& file, const TrackSet& tracks);
/// Reads track_artifact/tracks.bin. Throws Error(BadInput) for a truncated or foreign file.
TrackSet read_tracks(const std::filesystem::path& track_artifact);

}  // namespace vantage
