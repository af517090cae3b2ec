#include "jobs/sync/motion_barcode.h"

#include <algorithm>
#include <cmath>

namespace vantage::sync {
namespace {

using Side = EpipolarPencil::Side;

/// Planes are as far apart as limbs are wide, in cells: finer ones are crossed between two frames.
constexpr double kPlaneCells = 4;
constexpr int kMaxPlanes = 200;
constexpr Eigen::Index kMinFrames = 6;

struct AngleRange {
  double min_rad = 1e9, max_rad = -1e9;
};

/// Angles of all cells, row by row.
std::vector<double> cell_angles(const MovingAreas& areas, const EpipolarPencil& pencil, Side side, AngleRange& range) {
  std::vector<double> angles;
  for (int y = 0; y < areas.rows; ++y)
    for (int x = 0; x < areas.columns; ++x) {
      angles.push_back(pencil.angle_rad(side, areas.cell_px * Eigen::Vector2d(x + 0.5, y + 0.5)));
      range.min_rad = std::min(range.min_rad, angles.back());
      range.max_rad = std::max(range.max_rad, angles.back());
    }
  return angles;
}

/// Planes that both pictures see, evenly spaced.
struct Planes {
  AngleRange range;
  int num = 0;
  int index_of(double angle_rad) const {
    const double at = (angle_rad - range.min_rad) / (range.max_rad - range.min_rad) * num;
    return at < 0 || at >= num ? -1 : static_cast<int>(at);
  }
};

Planes shared_planes(const AngleRange& a, const AngleRange& b, double plane_rad) {
  Planes planes{{std::max(a.min_rad, b.min_rad), std::min(a.max_rad, b.max_rad)}, 0};
  const double width = planes.range.max_rad - planes.range.min_rad;
  if (width > 0) planes.num = std::clamp(static_cast<int>(width / plane_rad), 1, kMaxPlanes);
  return planes;
}

double plane_width_rad(const MovingAreas& areas, const EpipolarPencil& pencil, Side side) {
  return kPlaneCells * areas.cell_px *
         pencil.rad_per_px(side, 0.5 * areas.cell_px * Eigen::Vector2d(areas.columns, areas.rows));
}

MotionBarcode barcode_of(const MovingAreas& areas, const FrameTable& table, const std::vector<double>& angles,
                         const Planes& planes) {
  const auto moves = [](const auto& runs) { return !runs.empty(); };
  const auto first = std::find_if(areas.frames.begin(), areas.frames.end(), moves);
  const auto last = std::find_if(areas.frames.rbegin(), areas.frames.rend(), moves).base();
  if (last - first < kMinFrames) return {};
  MotionBarcode code;
  code.amounts = Eigen::MatrixXf::Zero(planes.num, last - first);
  for (auto frame = first; frame != last; ++frame) {
    code.times_s.push_back(table.pts_s[static_cast<std::size_t>(frame - areas.frames.begin())]);
    for (const MovingRun& run : *frame)
      for (std::size_t x = run.begin; x < run.end; ++x)
        if (const int p = planes.index_of(angles[std::size_t{run.row} * static_cast<std::size_t>(areas.columns) + x]);
            p >= 0)
          code.amounts(p, frame - first) += 1;
  }
  code.amounts = code.amounts.cwiseSqrt();
  return code;
}

/// Columns of both codes at the same moments, a's frames.
struct Overlap {
  Eigen::MatrixXf a, b;
};

Overlap overlap_at(const BarcodePair& codes, double offset_s) {
  const auto& times_b = codes.b.times_s;
  Overlap out{Eigen::MatrixXf(codes.a.amounts.rows(), codes.a.amounts.cols()), {}};
  out.b = out.a;
  Eigen::Index num = 0;
  for (std::size_t k = 0; k < codes.a.times_s.size(); ++k) {
    const double time_b = codes.a.times_s[k] - offset_s;
    if (time_b < times_b.front() || time_b > times_b.back()) continue;
    const auto after = std::upper_bound(times_b.begin() + 1, times_b.end() - 1, time_b);
    const auto j = after - times_b.begin();
    const auto u = static_cast<float>((time_b - *(after - 1)) / (*after - *(after - 1)));
    out.a.col(num) = codes.a.amounts.col(static_cast<Eigen::Index>(k));
    out.b.col(num) = (1 - u) * codes.b.amounts.col(j - 1) + u * codes.b.amounts.col(j);
    ++num;
  }
  out.a.conservativeResize(Eigen::NoChange, num);
  out.b.conservativeResize(Eigen::NoChange, num);
  return out;
}

double correlation(const Overlap& o) {
  if (o.a.cols() < kMinFrames) return 0;
  const Eigen::MatrixXf a = o.a.colwise() - o.a.rowwise().mean().eval(),
                        b = o.b.colwise() - o.b.rowwise().mean().eval();
  const double norm = std::sqrt(double{a.squaredNorm()} * double{b.squaredNorm()});
  return norm > 0 ? double{a.cwiseProduct(b).sum()} / norm : 0;
}

}  // namespace

BarcodePair motion_barcodes(const MovingAreas& a, const FrameTable& table_a, const MovingAreas& b,
                            const FrameTable& table_b, const EpipolarPencil& pencil) {
  AngleRange range_a, range_b;
  const auto angles_a = cell_angles(a, pencil, Side::A, range_a), angles_b = cell_angles(b, pencil, Side::B, range_b);
  const Planes planes = shared_planes(
      range_a, range_b, std::max(plane_width_rad(a, pencil, Side::A), plane_width_rad(b, pencil, Side::B)));
  if (planes.num == 0) return {};
  BarcodePair codes{barcode_of(a, table_a, angles_a, planes), barcode_of(b, table_b, angles_b, planes)};
  return codes.a.times_s.empty() || codes.b.times_s.empty() ? BarcodePair{} : codes;
}

OffsetScan scan_barcodes(const BarcodePair& codes, const OffsetRange& range) {
  OffsetScan scan{range, std::vector<double>(static_cast<std::size_t>(range.num()), 0), {}};
  if (codes.a.times_s.empty()) return scan;
  for (int k = 0; k < range.num(); ++k)
    scan.scores[static_cast<std::size_t>(k)] =
        std::max(0.0, correlation(overlap_at(codes, range.at(k)))) * range.overlap_s(range.at(k));
  scan.find_modes();
  return scan;
}

}  // namespace vantage::sync
