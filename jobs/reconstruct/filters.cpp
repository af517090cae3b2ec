#include "jobs/reconstruct/filters.h"

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

namespace vantage {
namespace {

/// Kappa of Eq. 9: two cell widths, the size of a cell and its neighbour.
double kappa(const LivePatch& a, const LivePatch& b) { return a.radius + b.radius; }

/// All live patches of each cell of one view.
class CellLists {
 public:
  CellLists(const PatchCloud& cloud, int view)
      : map_(&cloud.map(view)), start_(map_->nearest.size() + 1, 0), cell_(cloud.patches().size(), -1) {
    for (std::size_t i = 0; i < cell_.size(); ++i) {
      const LivePatch& p = cloud.patch(static_cast<int>(i));
      if (p.alive && p.seen_in(view)) cell_[i] = cloud.cell_of(p, view);
      if (cell_[i] >= 0) ++start_[static_cast<std::size_t>(cell_[i]) + 1];
    }
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    items_.resize(static_cast<std::size_t>(start_.back()));
    std::vector<int> at(start_.begin(), start_.end() - 1);
    for (std::size_t i = 0; i < cell_.size(); ++i)
      if (cell_[i] >= 0)
        items_[static_cast<std::size_t>(at[static_cast<std::size_t>(cell_[i])]++)] = static_cast<int>(i);
  }
  int cell_of(int patch) const { return cell_[static_cast<std::size_t>(patch)]; }
  /// Calls visit(patch) for all patches within reach cells of a patch, itself left out.
  template <class Visit>
  void around(int patch, int reach, const Visit& visit) const {
    const int cell = cell_of(patch);
    if (cell < 0) return;
    const int cx = cell % map_->cols, cy = cell / map_->cols;
    for (int y = std::max(0, cy - reach); y <= std::min(map_->rows - 1, cy + reach); ++y)
      for (int x = std::max(0, cx - reach); x <= std::min(map_->cols - 1, cx + reach); ++x) {
        const auto c = static_cast<std::size_t>(y * map_->cols + x);
        for (int k = start_[c]; k < start_[c + 1]; ++k)
          if (const int other = items_[static_cast<std::size_t>(k)]; other != patch) visit(other);
      }
  }

 private:
  const CellMap* map_;
  std::vector<int> start_, cell_, items_;
};

/// For each patch: the view in which its neighbourhood is looked at, the main view of its own camera when that sees it.
int home_view(const PatchCloud& cloud, const LivePatch& p) {
  const ViewGroup& group = cloud.group();
  for (int v = 0; v < group.num_views(); ++v)
    if (group.view(v).main && group.view(v).camera == group.view(p.reference).camera && p.seen_in(v)) return v;
  return p.reference;
}

std::vector<CellLists> all_lists(const PatchCloud& cloud) {
  std::vector<CellLists> lists;
  for (int v = 0; v < cloud.group().num_views(); ++v) lists.emplace_back(cloud, v);
  return lists;
}

int kill(PatchCloud& cloud, const std::vector<int>& doomed) {
  for (const int i : doomed) cloud.patch(i).alive = false;
  return static_cast<int>(doomed.size());
}

/// Furukawa and Ponce's visibility consistency: a patch falls when the patches it contradicts in its cells weigh more
/// than its own views.
int drop_in_front(PatchCloud& cloud, const std::vector<CellLists>& lists) {
  std::vector<int> doomed, rivals;
  for (int i = 0; i < static_cast<int>(cloud.patches().size()); ++i) {
    const LivePatch& p = cloud.patch(i);
    rivals.clear();
    for (int v = 0; v < cloud.group().num_views(); ++v) {
      if (!cloud.group().view(v).main || !p.seen_in(v)) continue;
      const double t = cloud.group().view(v).time_s;
      lists[static_cast<std::size_t>(v)].around(i, 0, [&](int other) {
        const LivePatch& q = cloud.patch(other);
        if (!lie_on_one_surface(p, q, t, 2 * kappa(p, q))) rivals.push_back(other);
      });
    }
    std::sort(rivals.begin(), rivals.end());
    rivals.erase(std::unique(rivals.begin(), rivals.end()), rivals.end());
    double against = 0;
    for (const int r : rivals) against += cloud.patch(r).score;
    if (std::popcount(p.seen) * p.score < against) doomed.push_back(i);
  }
  return kill(cloud, doomed);
}

int drop_behind(PatchCloud& cloud, int min_views) {
  std::vector<int> doomed;
  for (int i = 0; i < static_cast<int>(cloud.patches().size()); ++i) {
    LivePatch& p = cloud.patch(i);
    if (!p.alive) continue;
    for (int v = 0; v < cloud.group().num_views(); ++v) {
      if (!p.seen_in(v)) continue;
      const Projection at = project(cloud.group().view(v), p.at(cloud.group().view(v).time_s));
      const int cell = cloud.cell_at(v, at.px);
      if (cell < 0) continue;
      const int front = cloud.map(v).nearest[static_cast<std::size_t>(cell)];
      if (front >= 0 && cloud.patch(front).alive && cloud.is_hidden(v, cell, at.depth)) p.seen &= ~(ViewSet{1} << v);
    }
    if (std::popcount(p.seen) < min_views || !p.seen_in(p.reference)) doomed.push_back(i);
  }
  return kill(cloud, doomed);
}

/// §6.1: the share of the local region's patches that are similar must reach z.
int drop_irregular(PatchCloud& cloud, const std::vector<CellLists>& lists, const FilterOptions& options) {
  std::vector<int> doomed;
  for (int i = 0; i < static_cast<int>(cloud.patches().size()); ++i) {
    const LivePatch& p = cloud.patch(i);
    if (!p.alive) continue;
    const int home = home_view(cloud, p);
    const double t = cloud.group().view(home).time_s;
    int all = 0, similar = 0;
    lists[static_cast<std::size_t>(home)].around(i, options.window_cells, [&](int other) {
      if (!cloud.patch(other).alive) return;
      ++all;
      similar += lie_on_one_surface(p, cloud.patch(other), t, kappa(p, cloud.patch(other)));
    });
    if (similar < options.regularity * all) doomed.push_back(i);
  }
  return kill(cloud, doomed);
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Whether a velocity is far from the median of others: over half a cell during the group, and over 3 (scaled) MAD.
bool is_velocity_outlier(const Eigen::Vector3d& v, const std::vector<Eigen::Vector3d>& others, double tolerance) {
  Eigen::Vector3d centre;
  std::vector<double> values(others.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(others.begin(), others.end(), values.begin(), [axis](const auto& o) { return o(axis); });
    centre(axis) = median(values);
  }
  std::transform(others.begin(), others.end(), values.begin(), [&](const auto& o) { return (o - centre).norm(); });
  return (v - centre).norm() > std::max(tolerance, 3 * 1.4826 * median(values));
}

int drop_velocity_outliers(PatchCloud& cloud, const std::vector<CellLists>& lists, const FilterOptions& options) {
  const double duration = cloud.group().duration_s();
  if (duration <= 0) return 0;
  std::vector<int> doomed;
  std::vector<Eigen::Vector3d> others;
  for (int i = 0; i < static_cast<int>(cloud.patches().size()); ++i) {
    const LivePatch& p = cloud.patch(i);
    if (!p.alive || !p.moves) continue;
    const int home = home_view(cloud, p);
    const double t = cloud.group().view(home).time_s;
    others.clear();
    lists[static_cast<std::size_t>(home)].around(i, options.window_cells, [&](int other) {
      const LivePatch& q = cloud.patch(other);
      if (q.alive && lie_on_one_surface(p, q, t, kappa(p, q))) others.push_back(q.velocity);
    });
    if (others.size() >= 3 && is_velocity_outlier(p.velocity, others, 0.5 * p.radius / duration)) doomed.push_back(i);
  }
  return kill(cloud, doomed);
}

/// Union-find with path halving.
class Components {
 public:
  explicit Components(std::size_t count) : parent_(count), size_(count, 1) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int find(int i) {
    while (at(i) != i) i = at(i) = at(at(i));
    return i;
  }
  void join(int a, int b) {
    a = find(a);
    b = find(b);
    if (a == b) return;
    if (a > b) std::swap(a, b);
    at(b) = a;
    size_[static_cast<std::size_t>(a)] += size_[static_cast<std::size_t>(b)];
  }
  int size(int i) { return size_[static_cast<std::size_t>(find(i))]; }

 private:
  int& at(int i) { return parent_[static_cast<std::size_t>(i)]; }
  std::vector<int> parent_, size_;
};

int drop_islands(PatchCloud& cloud, const std::vector<CellLists>& lists, const FilterOptions& options) {
  Components components(cloud.patches().size());
  for (int i = 0; i < static_cast<int>(cloud.patches().size()); ++i) {
    const LivePatch& p = cloud.patch(i);
    if (!p.alive) continue;
    for (int v = 0; v < cloud.group().num_views(); ++v) {
      if (!cloud.group().view(v).main || !p.seen_in(v)) continue;
      const double t = cloud.group().view(v).time_s;
      lists[static_cast<std::size_t>(v)].around(i, options.window_cells, [&](int other) {
        const LivePatch& q = cloud.patch(other);
        if (q.alive && q.moves == p.moves && lie_on_one_surface(p, q, t, kappa(p, q))) components.join(i, other);
      });
    }
  }
  std::vector<int> doomed;
  for (int i = 0; i < static_cast<int>(cloud.patches().size()); ++i)
    if (cloud.patch(i).alive && components.size(i) < options.min_component) doomed.push_back(i);
  return kill(cloud, doomed);
}

}  // namespace

FilterReport filter(PatchCloud& cloud, const FilterOptions& options) {
  const std::vector<CellLists> lists = all_lists(cloud);
  FilterReport report;
  report.in_front = drop_in_front(cloud, lists);
  report.behind = drop_behind(cloud, options.min_views);
  report.irregular = drop_irregular(cloud, lists, options);
  report.velocity = drop_velocity_outliers(cloud, lists, options);
  report.island = drop_islands(cloud, lists, options);
  cloud.rebuild();
  return report;
}

void smooth_velocities(PatchCloud& cloud, int window_cells) {
  const std::vector<CellLists> lists = all_lists(cloud);
  std::vector<Eigen::Vector3d> smooth;
  for (int i = 0; i < static_cast<int>(cloud.patches().size()); ++i) {
    const LivePatch& p = cloud.patch(i);
    smooth.push_back(p.velocity);
    if (!p.moves) continue;
    const int home = home_view(cloud, p);
    const double t = cloud.group().view(home).time_s;
    int count = 1;
    lists[static_cast<std::size_t>(home)].around(i, window_cells, [&](int other) {
      const LivePatch& q = cloud.patch(other);
      if (!q.moves || !lie_on_one_surface(p, q, t, kappa(p, q))) return;
      smooth.back() += q.velocity;
      ++count;
    });
    smooth.back() /= count;
  }
  for (int i = 0; i < static_cast<int>(cloud.patches().size()); ++i) {
    LivePatch& p = cloud.patch(i);
    const double t = cloud.group().view(p.reference).time_s;
    p.position += t * (p.velocity - smooth[static_cast<std::size_t>(i)]);
    p.velocity = smooth[static_cast<std::size_t>(i)];
  }
}

}  // namespace vantage
