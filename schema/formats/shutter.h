#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>

namespace vantage {

/// When row y of a picture is exposed against its time stamp. A camera's time is that of its middle row, so readout_s,
/// the time from the first row's exposure to the last one's, moves a point by readout_s * (y / height - 0.5).
double row_delay_s(double y_px, int height_px, double readout_s);

/// shutter.json of a sync artifact: what a pair's residuals say of how long the two cameras' rows take to be read out,
/// as normal equations H x = g of x = (offset in s, read-out of a in s, read-out of b in s), beyond what was given for
/// them.
struct PairShutter {
  std::string a, b;
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
};

/// Empty when the pair had no points to say it by.
std::optional<PairShutter> read_pair_shutter(const std::filesystem::path& sync_artifact);
void write_pair_shutter(const std::filesystem::path& file, const PairShutter& shutter);

}  // namespace vantage
