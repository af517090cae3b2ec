#include "jobs/sync/frontier.h"

#include <algorithm>
#include <cmath>

namespace vantage::sync {
namespace {

/// Things less than this apart across the epipolar lines count as one.
constexpr double kMaxGapCells = 4;
constexpr std::size_t kMinThingCells = 30;
/// A frontier is where a few cells lie beyond: a single one may be noise.
constexpr std::size_t kCellsBeyond = 2;
/// Of the picture's longer side, from frame to frame, after what the last step foretells.
constexpr double kMaxJumpOfSide = 0.025;
constexpr std::size_t kMinSamples = 5;

struct Cell {
  double angle_rad = 0;
  bool at_rim = false;
  Eigen::Vector2d px{0, 0};
};

struct Edge {
  bool upper = false;
  double angle_rad = 0, rad_per_px = 0;
  Eigen::Vector2d px{0, 0};
};

/// The cells' angles are known beforehand: they are the same in every frame.
class Grid {
 public:
  Grid(const MovingAreas& areas, const EpipolarPencil& pencil, EpipolarPencil::Side side) : columns_(areas.columns) {
    for (int y = 0; y < areas.rows; ++y)
      for (int x = 0; x < areas.columns; ++x) {
        const Eigen::Vector2d px = areas.cell_px * Eigen::Vector2d(x + 0.5, y + 0.5);
        const bool rim = x < 2 || y < 2 || x >= areas.columns - 2 || y >= areas.rows - 2;
        cells_.push_back({pencil.angle_rad(side, px), rim, px});
      }
  }
  std::vector<Cell> sorted(const std::vector<MovingRun>& runs) const {
    std::vector<Cell> found;
    for (const MovingRun& run : runs)
      for (int x = run.begin; x < run.end; ++x)
        found.push_back(cells_[static_cast<std::size_t>(run.row) * static_cast<std::size_t>(columns_) +
                               static_cast<std::size_t>(x)]);
    std::sort(found.begin(), found.end(), [](const Cell& p, const Cell& q) { return p.angle_rad < q.angle_rad; });
    return found;
  }

 private:
  int columns_;
  std::vector<Cell> cells_;
};

class EdgeFinder {
 public:
  EdgeFinder(const EpipolarPencil& pencil, EpipolarPencil::Side side, int cell_px)
      : pencil_(pencil), side_(side), cell_px_(cell_px) {}

  /// Both ends of every stretch of angles that moving cells fill.
  std::vector<Edge> edges(const std::vector<Cell>& cells) const {
    std::vector<Edge> out;
    for (std::size_t first = 0; first < cells.size();) {
      std::size_t last = first;
      while (last + 1 < cells.size() && cells[last + 1].angle_rad - cells[last].angle_rad <= gap_rad(cells[last]))
        ++last;
      if (last - first + 1 >= kMinThingCells) {
        add(out, cells, first, first + kCellsBeyond, false);
        add(out, cells, last, last - kCellsBeyond, true);
      }
      first = last + 1;
    }
    return out;
  }

 private:
  double gap_rad(const Cell& cell) const { return kMaxGapCells * cell_px_ * pencil_.rad_per_px(side_, cell.px); }
  void add(std::vector<Edge>& out, const std::vector<Cell>& cells, std::size_t outermost, std::size_t at,
           bool upper) const {
    for (std::size_t k = std::min(outermost, at); k <= std::max(outermost, at); ++k)
      if (cells[k].at_rim) return;
    out.push_back({upper, cells[at].angle_rad, pencil_.rad_per_px(side_, cells[at].px), cells[at].px});
  }

  const EpipolarPencil& pencil_;
  EpipolarPencil::Side side_;
  int cell_px_;
};

double foretold(const Frontier& f) {
  const std::size_t n = f.angles_rad.size();
  return n < 2 ? f.angles_rad.back() : 2 * f.angles_rad[n - 1] - f.angles_rad[n - 2];
}

/// Lengthens the live frontiers by a frame's edges, nearest first; what is left begins new ones.
class FrontierLinker {
 public:
  explicit FrontierLinker(double max_jump_px) : max_jump_px_(max_jump_px) {}

  void add_frame(double time_s, const std::vector<Edge>& edges) {
    struct Link {
      double jump_px;
      std::size_t frontier, edge;
    };
    std::vector<Link> links;
    for (std::size_t f = 0; f < live_.size(); ++f)
      for (std::size_t e = 0; e < edges.size(); ++e) {
        const double jump_px = std::abs(edges[e].angle_rad - foretold(live_[f])) / edges[e].rad_per_px;
        if (live_[f].upper == edges[e].upper && jump_px <= max_jump_px_) links.push_back({jump_px, f, e});
      }
    std::stable_sort(links.begin(), links.end(), [](auto& p, auto& q) { return p.jump_px < q.jump_px; });
    std::vector<bool> continued(live_.size(), false), taken(edges.size(), false);
    for (const Link& link : links) {
      if (continued[link.frontier] || taken[link.edge]) continue;
      continued[link.frontier] = taken[link.edge] = true;
      live_[link.frontier].times_s.push_back(time_s);
      live_[link.frontier].angles_rad.push_back(edges[link.edge].angle_rad);
    }
    retire(continued);
    for (std::size_t e = 0; e < edges.size(); ++e)
      if (!taken[e])
        live_.push_back({edges[e].upper, {time_s}, {edges[e].angle_rad}, edges[e].rad_per_px, edges[e].px});
  }
  std::vector<Frontier> finish() {
    retire(std::vector<bool>(live_.size(), false));
    std::stable_sort(done_.begin(), done_.end(), [](auto& p, auto& q) { return p.begin_s() < q.begin_s(); });
    return std::move(done_);
  }

 private:
  void retire(const std::vector<bool>& continued) {
    std::vector<Frontier> kept;
    for (std::size_t f = 0; f < live_.size(); ++f) (continued[f] ? kept : done_).push_back(std::move(live_[f]));
    live_ = std::move(kept);
  }

  double max_jump_px_;
  std::vector<Frontier> live_, done_;
};

}  // namespace

std::optional<double> Frontier::at(double time_s) const {
  if (time_s < begin_s() || time_s > end_s()) return std::nullopt;
  const auto after = std::upper_bound(times_s.begin() + 1, times_s.end() - 1, time_s);
  const auto k = static_cast<std::size_t>(after - times_s.begin());
  const double u = (time_s - times_s[k - 1]) / (times_s[k] - times_s[k - 1]);
  return (1 - u) * angles_rad[k - 1] + u * angles_rad[k];
}

std::vector<Frontier> find_frontiers(const MovingAreas& areas, const FrameTable& table, const EpipolarPencil& pencil,
                                     EpipolarPencil::Side side) {
  const Grid grid(areas, pencil, side);
  const EdgeFinder finder(pencil, side, areas.cell_px);
  FrontierLinker linker(kMaxJumpOfSide * areas.cell_px * std::max(areas.columns, areas.rows));
  for (std::size_t f = 0; f < areas.frames.size() && f < table.pts_s.size(); ++f)
    linker.add_frame(table.pts_s[f], finder.edges(grid.sorted(areas.frames[f])));
  std::vector<Frontier> found = linker.finish();
  std::erase_if(found, [](const Frontier& f) { return f.times_s.size() < kMinSamples; });
  return found;
}

std::vector<Frontier> cut_frontiers(const std::vector<Frontier>& frontiers, double max_s) {
  std::vector<Frontier> pieces;
  for (const Frontier& whole : frontiers) {
    const double num = std::max(1.0, std::ceil((whole.end_s() - whole.begin_s()) / max_s));
    const auto per_piece = static_cast<std::size_t>(std::ceil(static_cast<double>(whole.times_s.size()) / num));
    for (std::size_t first = 0; first + kMinSamples <= whole.times_s.size(); first += per_piece) {
      const std::size_t end = std::min(first + per_piece, whole.times_s.size());
      if (end - first < kMinSamples) continue;
      Frontier piece = whole;
      const auto from = static_cast<std::ptrdiff_t>(first), to = static_cast<std::ptrdiff_t>(end);
      piece.times_s.assign(whole.times_s.begin() + from, whole.times_s.begin() + to);
      piece.angles_rad.assign(whole.angles_rad.begin() + from, whole.angles_rad.begin() + to);
      pieces.push_back(std::move(piece));
    }
  }
  return pieces;
}

}  // namespace vantage::sync
