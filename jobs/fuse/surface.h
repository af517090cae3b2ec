#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "jobs/fuse/fuse_patches.h"

namespace vantage {

struct SurfaceOptions {
  int depth = 9;
  int trim = 7;
};

/// Poisson surface (Kazhdan and Hoppe 2013) with vertex colours through COLMAP's poisson_mesher. Returns the number of
/// its vertices, 0 when there is no usable surface (too few points, everything trimmed away): out is then not written.
/// Throws Error(Transient) when the program cannot be started.
int write_poisson_surface(const std::filesystem::path& points_ply, const std::filesystem::path& out,
                          const std::filesystem::path& scratch, const SurfaceOptions& options);

/// The patches themselves as squares of their spacing's side: what is left when no closed surface can be made.
void write_patch_squares(const std::filesystem::path& out, const std::vector<Patch>& patches, float time_s,
                         const PatchSpacing& spacing);

}  // namespace vantage
