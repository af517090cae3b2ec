#include "tests/support/texture.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace vantage::synthetic {
namespace {

double lattice(std::int64_t x, std::int64_t y, std::int64_t z, std::uint64_t seed) {
  std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15ULL ^
                    static_cast<std::uint64_t>(y) * 0xC2B2AE3D27D4EB4FULL ^
                    static_cast<std::uint64_t>(z) * 0x165667B19E3779F9ULL ^ seed * 0xD6E8FEB86659FD93ULL;
  h = (h ^ (h >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  h = (h ^ (h >> 27U)) * 0x94D049BB133111EBULL;
  return static_cast<double>((h ^ (h >> 31U)) >> 11U) * 0x1.0p-53;
}

double smooth(double t) { return t * t * (3 - 2 * t); }

double value_noise(const Eigen::Vector3d& p, std::uint64_t seed) {
  const double fx = std::floor(p.x()), fy = std::floor(p.y()), fz = std::floor(p.z());
  const auto ix = static_cast<std::int64_t>(fx), iy = static_cast<std::int64_t>(fy), iz = static_cast<std::int64_t>(fz);
  const double u = smooth(p.x() - fx), v = smooth(p.y() - fy), w = smooth(p.z() - fz);
  const auto along_x = [&](std::int64_t dy, std::int64_t dz) {
    return std::lerp(lattice(ix, iy + dy, iz + dz, seed), lattice(ix + 1, iy + dy, iz + dz, seed), u);
  };
  return std::lerp(std::lerp(along_x(0, 0), along_x(1, 0), v), std::lerp(along_x(0, 1), along_x(1, 1), v), w);
}

}  // namespace

Eigen::Vector3d solid_texture(int object_id, const Eigen::Vector3d& point) {
  const auto seed = static_cast<std::uint64_t>(object_id) * 16 + 1;
  double light = 0, frequency = 1 / 0.6, amplitude = 0.34;
  for (std::uint64_t octave = 0; octave < 5; ++octave, frequency *= 2.05, amplitude *= 0.9)
    light += amplitude * (value_noise(point * frequency, seed + octave) - 0.5);
  const double hue = 6.2831853 * (0.17 * object_id + 0.35 * value_noise(point * 1.7, seed + 9));
  const double level = std::clamp(0.52 + light, 0.04, 0.96);
  return {level * (0.75 + 0.25 * std::cos(hue)), level * (0.75 + 0.25 * std::cos(hue + 2.1)),
          level * (0.75 + 0.25 * std::cos(hue + 4.2))};
}

}  // namespace vantage::synthetic
