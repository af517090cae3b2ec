#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <vector>

namespace vantage {

/// A small moving piece of surface (Klose et al. 2011, §6): at shot time t, for t0_s <= t <= t1_s, it is at
/// position + velocity * (t - t0_s).
struct Patch {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< world units, at t0_s
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();   ///< unit, towards the cameras
  Eigen::Vector3f velocity = Eigen::Vector3f::Zero();  ///< world units per second
  float t0_s = 0, t1_s = 0;
  Eigen::Matrix<unsigned char, 3, 1> rgb = Eigen::Matrix<unsigned char, 3, 1>::Zero();
  float score = 0;  ///< mean normalised cross-correlation over its images
  int num_views = 0;
  Eigen::Vector3f position_at(float t_s) const { return position + velocity * (t_s - t0_s); }
};

/// Binary little-endian PLY with x y z nx ny nz vx vy vz t0 t1 red green blue score num_views.
void write_patches_ply(const std::filesystem::path& path, const std::vector<Patch>& patches);
/// Reads what write_patches_ply wrote. Throws Error(BadInput) for anything else.
std::vector<Patch> read_patches_ply(const std::filesystem::path& path);
/// x y z nx ny nz red green blue: what point viewers and meshers read.
void write_points_ply(const std::filesystem::path& path, const std::vector<Patch>& patches, float time_s);

}  // namespace vantage
