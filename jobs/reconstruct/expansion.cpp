#include "jobs/reconstruct/expansion.h"

#include <cmath>
#include <queue>

namespace vantage {
namespace {

constexpr int kMaxTries = 2;  ///< expansions into a cell that may fail before it is left alone

/// Cells of the main views that have texture to compare.
std::size_t count_textured_cells(const PatchCloud& cloud) {
  std::size_t count = 0;
  for (int v = 0; v < cloud.group().num_views(); ++v) {
    if (!cloud.group().view(v).main) continue;
    const int cells = cloud.map(v).cols * cloud.map(v).rows;
    for (int c = 0; c < cells; ++c)
      count += ReferenceTexture::sample(cloud.group(), v, cloud.cell_point(v, c)).has_value();
  }
  return count;
}

double coverage(const PatchCloud& cloud, std::size_t textured) {
  std::size_t filled = 0;
  for (int v = 0; v < cloud.group().num_views(); ++v)
    if (cloud.group().view(v).main) filled += cloud.num_filled(v);
  return static_cast<double>(filled) / static_cast<double>(std::max<std::size_t>(1, textured));
}

/// The patch's plane seen through a cell of a view: where a neighbour would be. Empty when the ray misses the plane or
/// meets it far away, at a grazing angle.
std::optional<PatchGuess> neighbour_guess(const PatchCloud& cloud, const LivePatch& patch, int view_index, int cell) {
  const View& view = cloud.group().view(view_index);
  const Eigen::Vector3d ray = world_ray(view, cloud.cell_point(view_index, cell));
  const Eigen::Vector3d centre = patch.at(view.time_s);
  const double along = patch.normal.dot(ray);
  if (along >= -0.1 * ray.norm()) return std::nullopt;
  const double depth = patch.normal.dot(centre - view.centre) / along;
  const Eigen::Vector3d point = view.centre + depth * ray;
  if (depth <= 0 || (point - centre).norm() > 10 * cloud.cell_width(view_index, depth)) return std::nullopt;
  return PatchGuess{view_index, point - view.time_s * patch.velocity, patch.normal, patch.velocity, patch.moves};
}

/// The up to four neighbours of a cell inside the grid.
std::vector<int> neighbours(const CellMap& map, int cell) {
  const int x = cell % map.cols, y = cell / map.cols;
  std::vector<int> out;
  if (x > 0) out.push_back(cell - 1);
  if (x + 1 < map.cols) out.push_back(cell + 1);
  if (y > 0) out.push_back(cell - map.cols);
  if (y + 1 < map.rows) out.push_back(cell + map.cols);
  return out;
}

class Expander {
 public:
  Expander(PatchCloud& cloud, const ExpansionOptions& options) : cloud_(cloud), options_(options) {
    for (std::size_t i = 0; i < cloud.patches().size(); ++i) push(static_cast<int>(i));
  }
  bool is_done() const { return queue_.empty() || static_cast<int>(cloud_.patches().size()) >= options_.max_patches; }
  /// Expands the best patch of the queue in all its main views.
  void step(ExpansionReport& report) {
    const int parent = queue_.top().second;
    queue_.pop();
    for (int v = 0; v < cloud_.group().num_views(); ++v) {
      if (!cloud_.group().view(v).main || !cloud_.patch(parent).seen_in(v)) continue;
      const int cell = cloud_.cell_of(cloud_.patch(parent), v);
      if (cell < 0) continue;
      for (const int next : neighbours(cloud_.map(v), cell)) fill(parent, v, next, report);
    }
  }

 private:
  /// Higher score first, then older.
  struct Later {
    bool operator()(const std::pair<double, int>& a, const std::pair<double, int>& b) const {
      return a.first < b.first || (a.first == b.first && a.second > b.second);
    }
  };
  void push(int patch) { queue_.emplace(cloud_.patch(patch).score, patch); }

  void fill(int parent, int view, int cell, ExpansionReport& report) {
    const auto c = static_cast<std::size_t>(cell);
    const bool moves = cloud_.patch(parent).moves;
    unsigned char& tried = cloud_.map(view).tried[moves][c];
    if (cloud_.map(view).nearest[c] >= 0 || tried >= kMaxTries) return;
    const auto guess = neighbour_guess(cloud_, cloud_.patch(parent), view, cell);
    if (!guess) return;
    ++report.num_tried;
    const auto child = build_patch(cloud_, *guess, options_.build);
    if (!child) {
      ++tried;
      return;
    }
    ++report.num_added;
    push(cloud_.add(*child));
  }

  PatchCloud& cloud_;
  const ExpansionOptions& options_;
  std::priority_queue<std::pair<double, int>, std::vector<std::pair<double, int>>, Later> queue_;
};

/// A static patch as it would be with a velocity: where it is now at its reference's time.
PatchGuess set_in_motion(const PatchCloud& cloud, const LivePatch& patch, const Eigen::Vector3d& velocity) {
  return {patch.reference, patch.position - cloud.group().view(patch.reference).time_s * velocity, patch.normal,
          velocity, true};
}

/// Static patches in the cells around a patch, in the main views that see it, that lie on its surface.
std::vector<int> static_neighbours(const PatchCloud& cloud, int patch) {
  const LivePatch& p = cloud.patch(patch);
  std::vector<int> out;
  for (int v = 0; v < cloud.group().num_views(); ++v) {
    const int cell = cloud.group().view(v).main && p.seen_in(v) ? cloud.cell_of(p, v) : -1;
    if (cell < 0) continue;
    for (const int next : neighbours(cloud.map(v), cell)) {
      const int other = cloud.map(v).nearest[static_cast<std::size_t>(next)];
      if (other < 0 || cloud.patch(other).moves) continue;
      const LivePatch& q = cloud.patch(other);
      if (lie_on_one_surface(p, q, cloud.group().view(v).time_s, 2 * (p.radius + q.radius))) out.push_back(other);
    }
  }
  return out;
}

}  // namespace

int spread_motion(PatchCloud& cloud, const BuildOptions& options) {
  std::vector<int> work;
  for (int i = 0; i < static_cast<int>(cloud.patches().size()); ++i)
    if (cloud.patch(i).moves) work.push_back(i);
  std::vector<bool> tested(cloud.patches().size(), false);
  int changed = 0;
  for (std::size_t k = 0; k < work.size(); ++k)
    for (const int other : static_neighbours(cloud, work[k])) {
      if (tested[static_cast<std::size_t>(other)]) continue;
      tested[static_cast<std::size_t>(other)] = true;
      const auto moving =
          build_patch(cloud, set_in_motion(cloud, cloud.patch(other), cloud.patch(work[k]).velocity), options);
      if (!moving) continue;
      cloud.patch(other) = *moving;
      work.push_back(other);
      ++changed;
    }
  return changed;
}

ExpansionReport expand(PatchCloud& cloud, const ExpansionOptions& options,
                       const std::function<void(double)>& progress) {
  constexpr int kCheckEvery = 500;  // steps; counting filled cells costs about as much as ten expansions
  ExpansionReport report;
  const std::size_t textured = count_textured_cells(cloud);
  Expander expander(cloud, options);
  for (int k = 0; !expander.is_done(); ++k) {
    if (k % kCheckEvery == 0) {
      report.coverage = coverage(cloud, textured);
      progress(report.coverage);
      if (report.coverage >= options.coverage) break;
    }
    expander.step(report);
  }
  report.coverage = coverage(cloud, textured);
  return report;
}

}  // namespace vantage
