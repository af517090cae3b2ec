#include "jobs/fuse/fuse_patches.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <set>
#include <unordered_map>

namespace vantage {
namespace {

bool is_static(const Patch& p) { return p.velocity.isZero(0.0F); }

/// Points in cubes whose side is the power of two at or above the search radius: neighbours lie in the 27 cubes around.
class SpatialHash {
 public:
  void insert(const Eigen::Vector3f& at, double radius, int item) {
    cubes_[key(cube_of(at, level(radius)), level(radius))].push_back(item);
  }
  /// Items inserted with a radius of the same power of two, near a point.
  template <class Visit>
  void near(const Eigen::Vector3f& at, double radius, const Visit& visit) const {
    const int l = level(radius);
    const Eigen::Vector3<std::int64_t> centre = cube_of(at, l);
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const auto found = cubes_.find(key(centre + Eigen::Vector3<std::int64_t>(dx, dy, dz), l));
          if (found == cubes_.end()) continue;
          for (const int item : found->second) visit(item);
        }
  }

 private:
  static int level(double radius) { return static_cast<int>(std::ceil(std::log2(std::max(radius, 1e-12)))); }
  static Eigen::Vector3<std::int64_t> cube_of(const Eigen::Vector3f& at, int level) {
    return (at.cast<double>() * std::ldexp(1.0, -level)).array().floor().cast<std::int64_t>();
  }
  static std::uint64_t key(const Eigen::Vector3<std::int64_t>& cube, int level) {
    std::uint64_t h = static_cast<std::uint64_t>(level + 1024);
    for (int i = 0; i < 3; ++i) h = (h ^ static_cast<std::uint64_t>(cube(i))) * 0x9E3779B97F4A7C15ULL + (h >> 29);
    return h;
  }
  std::unordered_map<std::uint64_t, std::vector<int>> cubes_;
};

/// Eq. 9 (magnitudes) for two places.
bool on_one_surface(const Eigen::Vector3f& between, const Eigen::Vector3f& n0, const Eigen::Vector3f& n1,
                    double kappa) {
  return n0.dot(n1) > 0 && std::abs(between.dot(n0)) + std::abs(between.dot(n1)) < kappa;
}

/// A patch of the model and what went into it.
struct Fused {
  Patch patch;
  int group = 0;
  double offset_sum = 0;  ///< of the merged patches along the normal, weighted by views
  double weight = 0;
};

struct Candidate {
  const Patch* patch;
  int group;
  double spacing;
};

/// Static patches, those that most images agree on first.
std::vector<Candidate> static_candidates(const std::vector<std::vector<Patch>>& groups, const PatchSpacing& spacing) {
  std::vector<Candidate> out;
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (const Patch& p : groups[g])
      if (is_static(p)) out.push_back({&p, static_cast<int>(g), spacing(p)});
  std::stable_sort(out.begin(), out.end(), [](const Candidate& a, const Candidate& b) {
    return a.patch->num_views != b.patch->num_views ? a.patch->num_views > b.patch->num_views
                                                    : a.patch->score > b.patch->score;
  });
  return out;
}

/// Drops candidates whose surface fewer than min_support other groups have seen within one and a half spacings. A no-op
/// for shots of fewer than five moments. Returns how many it dropped.
int drop_unsupported(std::vector<Candidate>& candidates, const FuseOptions& options) {
  constexpr std::size_t kFewestTimes = 5;
  constexpr double kReach = 1.5;
  std::set<float> times;
  for (const Candidate& c : candidates) times.insert(c.patch->t0_s);
  if (times.size() < kFewestTimes) return 0;
  SpatialHash hash;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    hash.insert(candidates[i].patch->position, kReach * candidates[i].spacing, static_cast<int>(i));
  const auto is_supported = [&](const Candidate& c) {
    std::set<int> others;
    hash.near(c.patch->position, kReach * c.spacing, [&](int i) {
      const Candidate& o = candidates[static_cast<std::size_t>(i)];
      if (static_cast<int>(others.size()) >= options.min_support || o.group == c.group) return;
      const Eigen::Vector3f between = o.patch->position - c.patch->position;
      if (between.norm() >= kReach * c.spacing) return;
      if (on_one_surface(between, c.patch->normal, o.patch->normal, options.kappa * c.spacing)) others.insert(o.group);
    });
    return static_cast<int>(others.size()) >= options.min_support;
  };
  std::vector<Candidate> supported;
  std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(supported), is_supported);
  const auto dropped = candidates.size() - supported.size();
  candidates = std::move(supported);
  return static_cast<int>(dropped);
}

void absorb(Fused& kept, const Patch& p) {
  const double weight = std::max(1, p.num_views);
  kept.offset_sum += weight * static_cast<double>((p.position - kept.patch.position).dot(kept.patch.normal));
  kept.weight += weight;
  kept.patch.t0_s = std::min(kept.patch.t0_s, p.t0_s);
  kept.patch.t1_s = std::max(kept.patch.t1_s, p.t1_s);
}

std::vector<Patch> fuse_static(const std::vector<std::vector<Patch>>& groups, const PatchSpacing& spacing,
                               const FuseOptions& options, FuseReport& report) {
  std::vector<Fused> kept;
  SpatialHash hash;
  std::vector<Candidate> candidates = static_candidates(groups, spacing);
  report.num_unsupported = drop_unsupported(candidates, options);
  for (const Candidate& c : candidates) {
    const double radius = options.merge_distance * c.spacing;
    int best = -1;
    double best_distance = radius;
    hash.near(c.patch->position, radius, [&](int i) {
      const Patch& other = kept[static_cast<std::size_t>(i)].patch;
      const Eigen::Vector3f between = other.position - c.patch->position;
      const double distance = between.norm();
      if (distance >= best_distance || kept[static_cast<std::size_t>(i)].group == c.group) return;
      if (!on_one_surface(between, c.patch->normal, other.normal, options.kappa * c.spacing)) return;
      best = i;
      best_distance = distance;
    });
    if (best >= 0) {
      absorb(kept[static_cast<std::size_t>(best)], *c.patch);
      continue;
    }
    hash.insert(c.patch->position, radius, static_cast<int>(kept.size()));
    kept.push_back({*c.patch, c.group, 0, static_cast<double>(std::max(1, c.patch->num_views))});
  }
  std::vector<Patch> out;
  for (Fused& f : kept) {
    f.patch.position += static_cast<float>(f.offset_sum / f.weight) * f.patch.normal;
    out.push_back(f.patch);
  }
  return out;
}

/// A patch that may still absorb patches of later groups.
struct Moving {
  Patch patch;
  float duration;  ///< of its own group
};

/// Kept patches of earlier groups that are still valid within a group's time, by where they are at the middle of the
/// overlap.
struct OverlapHash {
  float time_s;
  SpatialHash hash;
};

bool moves_alike(const Patch& a, const Patch& b, double duration, double tolerance) {
  return (a.velocity - b.velocity).norm() * duration < tolerance;
}

/// The better patch, valid while either was. Empty when that would be longer than linear motion is trusted.
std::optional<Patch> merged(const Moving& a, const Patch& b, double max_validity) {
  const float t0 = std::min(a.patch.t0_s, b.t0_s), t1 = std::max(a.patch.t1_s, b.t1_s);
  if (t1 - t0 > max_validity * a.duration + 1e-6) return std::nullopt;
  Patch p = a.patch.num_views >= b.num_views ? a.patch : b;
  p.position = p.position_at(t0);
  p.t0_s = t0;
  p.t1_s = t1;
  return p;
}

/// Looks for a patch of an earlier group that is the same as p and merges it; false when there is none.
bool merge_moving(std::vector<Moving>& kept, const std::vector<int>& earlier, const OverlapHash& overlap,
                  const Patch& p, double spacing, const FuseOptions& options) {
  const double radius = options.merge_distance * spacing;
  const Eigen::Vector3f at = p.position_at(overlap.time_s);
  int best = -1;
  double best_distance = radius;
  overlap.hash.near(at, radius, [&](int k) {
    const Moving& other = kept[static_cast<std::size_t>(earlier[static_cast<std::size_t>(k)])];
    const Eigen::Vector3f between = other.patch.position_at(overlap.time_s) - at;
    if (between.norm() >= best_distance || !moves_alike(p, other.patch, p.t1_s - p.t0_s, spacing)) return;
    if (!on_one_surface(between, p.normal, other.patch.normal, options.kappa * spacing)) return;
    best = earlier[static_cast<std::size_t>(k)];
    best_distance = between.norm();
  });
  if (best < 0) return false;
  const auto both = merged(kept[static_cast<std::size_t>(best)], p, options.max_validity);
  if (both) kept[static_cast<std::size_t>(best)].patch = *both;
  return both.has_value();
}

/// Kept patches that share time with a group, and the hash of where they are then.
std::pair<std::vector<int>, OverlapHash> overlapping(const std::vector<Moving>& kept, const Patch& any_of_group,
                                                     const PatchSpacing& spacing, const FuseOptions& options) {
  std::vector<int> earlier;
  OverlapHash overlap;
  float last = any_of_group.t0_s;
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (kept[i].patch.t1_s >= any_of_group.t0_s && kept[i].patch.t0_s <= any_of_group.t1_s) {
      earlier.push_back(static_cast<int>(i));
      last = std::max(last, kept[i].patch.t1_s);
    }
  overlap.time_s = (any_of_group.t0_s + std::min(last, any_of_group.t1_s)) / 2;
  for (std::size_t k = 0; k < earlier.size(); ++k) {
    const Patch& p = kept[static_cast<std::size_t>(earlier[k])].patch;
    overlap.hash.insert(p.position_at(overlap.time_s), options.merge_distance * spacing(p), static_cast<int>(k));
  }
  return {std::move(earlier), std::move(overlap)};
}

std::vector<Patch> fuse_moving(const std::vector<std::vector<Patch>>& groups, const PatchSpacing& spacing,
                               const FuseOptions& options) {
  std::vector<Moving> kept;
  for (const auto& group : groups) {
    if (group.empty()) continue;
    const auto [earlier, overlap] = overlapping(kept, group.front(), spacing, options);
    for (const Patch& p : group)
      if (!is_static(p) && !merge_moving(kept, earlier, overlap, p, spacing(p), options))
        kept.push_back({p, p.t1_s - p.t0_s});
  }
  std::vector<Patch> out;
  for (const Moving& m : kept) out.push_back(m.patch);
  return out;
}

}  // namespace

std::vector<Patch> fuse_patches(const std::vector<std::vector<Patch>>& groups, const PatchSpacing& spacing,
                                const FuseOptions& options, FuseReport& report) {
  std::vector<Patch> model = fuse_static(groups, spacing, options, report);
  report.num_static = static_cast<int>(model.size());
  const std::vector<Patch> moving = fuse_moving(groups, spacing, options);
  report.num_moving = static_cast<int>(moving.size());
  model.insert(model.end(), moving.begin(), moving.end());
  for (const auto& group : groups) report.num_in += static_cast<int>(group.size());
  report.num_merged = report.num_in - report.num_unsupported - static_cast<int>(model.size());
  return model;
}

}  // namespace vantage
