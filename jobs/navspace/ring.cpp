#include "jobs/navspace/ring.h"

#include <algorithm>
#include <map>
#include <string>
#include <vector>

namespace vantage {
namespace {

constexpr double kMaxGap_deg = 60;
constexpr double kMaxGapRatio = 1.5;
constexpr std::size_t kMinCameras = 5;
constexpr double kLevel_deg = 5;  ///< a ring that is not level is copied farther: its seam is a zigzag

struct Direction {
  double azimuth_deg = 0, elevation_deg = 0;
};

std::map<std::string, Direction> mean_directions(const Navspace& navspace) {
  std::map<std::string, Direction> sums;
  std::map<std::string, int> counts;
  for (const NavVertex& v : navspace.vertices) {
    sums[v.image.camera].azimuth_deg += v.azimuth_deg;
    sums[v.image.camera].elevation_deg += v.elevation_deg;
    ++counts[v.image.camera];
  }
  for (auto& [camera, sum] : sums) sum = {sum.azimuth_deg / counts[camera], sum.elevation_deg / counts[camera]};
  return sums;
}

}  // namespace

bool close_ring(Navspace& navspace) {
  const auto directions = mean_directions(navspace);
  if (directions.size() < kMinCameras) return false;
  std::vector<double> azimuths, elevations;
  for (const auto& [camera, d] : directions) {
    azimuths.push_back(d.azimuth_deg);
    elevations.push_back(d.elevation_deg);
  }
  std::sort(azimuths.begin(), azimuths.end());
  double widest = 0;
  for (std::size_t k = 1; k < azimuths.size(); ++k) widest = std::max(widest, azimuths[k] - azimuths[k - 1]);
  const double seam = azimuths.front() + 360 - azimuths.back();
  if (seam > std::min(kMaxGap_deg, kMaxGapRatio * widest)) return false;

  const auto [lowest, highest] = std::minmax_element(elevations.begin(), elevations.end());
  const double reach = *highest - *lowest > kLevel_deg ? 2 * std::max(seam, widest) : 0;
  const std::size_t count = navspace.vertices.size();
  for (std::size_t v = 0; v < count; ++v) {
    NavVertex copy = navspace.vertices[v];
    if (directions.at(copy.image.camera).azimuth_deg > azimuths.front() + reach) continue;
    copy.azimuth_deg += 360;
    navspace.vertices.push_back(std::move(copy));
  }
  return true;
}

}  // namespace vantage
