#include "jobs/sync/frontier_offset.h"

#include <algorithm>
#include <cmath>

namespace vantage::sync {
namespace {

using Side = EpipolarPencil::Side;

/// Frontiers lie within a few cells of where they should: masks are no better.
constexpr double kMaxDistanceCells = 4;
constexpr double kMaxBiasOfDistance = 1.5;
constexpr double kPieceS = 0.5;
/// A piece belongs to the frontier that most of its samples lie on.
constexpr double kMinShareOnOne = 0.5;

/// Of two angles in pixels, to first order as Sampson's distance.
double distance_px(const Frontier& a, const Frontier& b, double difference_rad) {
  return difference_rad / std::hypot(a.rad_per_px, b.rad_per_px);
}

/// How many samples of the piece run beside the other frontier, at one distance: the two cameras' masks differ by some
/// cells, and so may what is in front.
std::size_t num_beside(const Frontier& piece, const Frontier& other, double offset_s, double max_px) {
  std::vector<double> apart_px;
  for (std::size_t k = 0; k < piece.times_s.size(); ++k)
    if (const auto angle = other.at(piece.times_s[k] - offset_s))
      apart_px.push_back(distance_px(piece, other, piece.angles_rad[k] - *angle));
  if (apart_px.empty()) return 0;
  const auto middle = apart_px.begin() + static_cast<std::ptrdiff_t>(apart_px.size() / 2);
  std::nth_element(apart_px.begin(), middle, apart_px.end());
  const double bias_px = *middle;
  if (std::abs(bias_px) > kMaxBiasOfDistance * max_px) return 0;
  return static_cast<std::size_t>(
      std::count_if(apart_px.begin(), apart_px.end(), [&](double px) { return std::abs(px - bias_px) < max_px; }));
}

/// The frontier of b that most samples of the piece run beside; nullptr when they are few.
const Frontier* partner_of(const Frontier& piece, const std::vector<Frontier>& others, double offset_s, double max_px) {
  const Frontier* best = nullptr;
  std::size_t most = 0;
  for (const Frontier& other : others) {
    if (other.upper != piece.upper) continue;
    const std::size_t num = num_beside(piece, other, offset_s, max_px);
    if (num > most) most = num, best = &other;
  }
  return static_cast<double>(most) >= kMinShareOnOne * static_cast<double>(piece.times_s.size()) ? best : nullptr;
}

std::optional<TimedTrack> path_of(const Frontier& frontier, const EpipolarPencil& pencil, Side side) {
  std::vector<Eigen::Vector2d> px;
  for (const double angle_rad : frontier.angles_rad) {
    const auto at = pencil.pixel_of(side, angle_rad, frontier.through_px);
    if (!at) return std::nullopt;
    px.push_back(*at);
  }
  return TimedTrack(frontier.times_s, std::move(px));
}

std::vector<PathPair> pair_up(const std::vector<Frontier>& pieces, const std::vector<Frontier>& others,
                              const EpipolarPencil& pencil, double offset_s, double max_px) {
  std::vector<PathPair> pairs;
  for (const Frontier& piece : pieces) {
    const Frontier* other = partner_of(piece, others, offset_s, max_px);
    if (!other) continue;
    auto a = path_of(piece, pencil, Side::A), b = path_of(*other, pencil, Side::B);
    if (a && b) pairs.push_back({std::move(*a), std::move(*b)});
  }
  return pairs;
}

}  // namespace

FrontierAnswer offset_from_frontiers(const FrontierInput& in, const FrameTable& table_a, const FrameTable& table_b,
                                     const PairGeometry& geometry, const OffsetRange& range) {
  FrontierAnswer answer;
  answer.scan.range = range;
  if (!in.pencil.usable() || range.num() == 0) return answer;
  answer.scan = scan_barcodes(motion_barcodes(in.a, table_a, in.b, table_b, in.pencil), range);
  if (answer.scan.modes.empty()) return answer;
  const double start_s = answer.scan.modes.front().offset_s;
  const auto pieces = cut_frontiers(find_frontiers(in.a, table_a, in.pencil, Side::A), kPieceS);
  const auto others = find_frontiers(in.b, table_b, in.pencil, Side::B);
  const double max_px = kMaxDistanceCells * std::max(in.a.cell_px, in.b.cell_px);
  answer.pairs = pair_up(pieces, others, in.pencil, start_s, max_px);
  const double frame_s = std::max(frame_interval_s(table_a), frame_interval_s(table_b));
  answer.fit = fit_clock(answer.pairs, geometry, start_s, frame_s, range.overlap_s(start_s),
                         {.max_epipolar_px = 3 * max_px, .max_noise_px = 0.5 * max_px, .max_bias_px = max_px});
  return answer;
}

}  // namespace vantage::sync
