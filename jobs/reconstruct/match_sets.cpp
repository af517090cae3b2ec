#include "jobs/reconstruct/match_sets.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

namespace vantage {
namespace {

/// Matches of one pair: point of a, point of b.
using PairMatches = std::vector<std::pair<int, int>>;

Eigen::Matrix3d fundamental(const View& a, const View& b) {
  const Eigen::Matrix3d R = b.cam_from_world.R * a.cam_from_world.R.transpose();
  const Eigen::Vector3d t = b.cam_from_world.t - R * a.cam_from_world.t;
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  return b.pinhole.K().inverse().transpose() * cross * R * a.pinhole.K().inverse();
}

/// Says which points of b may match a point of a: near its epipolar line, or near itself for a camera that stood still.
class Gate {
 public:
  Gate(const View& a, const View& b, const MatchOptions& options) : same_place_((a.centre - b.centre).norm() < 1e-9) {
    const double width = b.pinhole.width;
    const double motion = std::abs(a.time_s - b.time_s) * options.max_speed_widths * width;
    reach_px_ = std::min(options.epipolar_px + motion, options.max_gate_widths * width);
    if (same_place_)
      transfer_ = b.pinhole.K() * b.cam_from_world.R * a.cam_from_world.R.transpose() * a.pinhole.K().inverse();
    else
      transfer_ = fundamental(a, b);
  }
  /// A function of b's pixels for one pixel of a.
  std::function<bool(const Eigen::Vector2d&)> at(const Eigen::Vector2d& px) const {
    const Eigen::Vector3d image = transfer_ * px.homogeneous();
    if (same_place_) {
      const Eigen::Vector2d centre = image.hnormalized();
      return
          [centre, reach = reach_px_](const Eigen::Vector2d& q) { return (q - centre).squaredNorm() <= reach * reach; };
    }
    const Eigen::Vector3d line = image / std::max(1e-12, image.head<2>().norm());
    return [line, reach = reach_px_](const Eigen::Vector2d& q) { return std::abs(line.dot(q.homogeneous())) <= reach; };
  }

 private:
  bool same_place_;
  double reach_px_ = 0;
  Eigen::Matrix3d transfer_;
};

float descriptor_distance2(const cv::Mat1f& a, int i, const cv::Mat1f& b, int j) {
  using Row = Eigen::Map<const Eigen::Matrix<float, 128, 1>>;
  return (Row(a[i]) - Row(b[j])).squaredNorm();
}

/// Best match in b of every point of a; -1 where the ratio test fails. Candidates within 3 px of the best do not count
/// as second best: they are the same thing.
std::vector<int> nearest(const View& a, const View& b, const InterestPoints& pa, const InterestPoints& pb,
                         const MatchOptions& options) {
  const Gate gate(a, b, options);
  std::vector<int> best(pa.px.size(), -1);
  std::vector<std::pair<float, int>> candidates;
  for (std::size_t i = 0; i < pa.px.size(); ++i) {
    candidates.clear();
    const auto allowed = gate.at(pa.px[i]);
    for (std::size_t j = 0; j < pb.px.size(); ++j)
      if (allowed(pb.px[j]))
        candidates.emplace_back(
            descriptor_distance2(pa.descriptors, static_cast<int>(i), pb.descriptors, static_cast<int>(j)),
            static_cast<int>(j));
    if (candidates.empty()) continue;
    const auto first = *std::min_element(candidates.begin(), candidates.end());
    float second = 2.0F;  // unit descriptors with no negative entries are at most sqrt(2) apart
    for (const auto& [distance, j] : candidates)
      if ((pb.px[static_cast<std::size_t>(j)] - pb.px[static_cast<std::size_t>(first.second)]).norm() > 3.0)
        second = std::min(second, distance);
    if (first.first < options.max_ratio * options.max_ratio * static_cast<double>(second)) best[i] = first.second;
  }
  return best;
}

PairMatches mutual_matches(const View& a, const View& b, const InterestPoints& pa, const InterestPoints& pb,
                           const MatchOptions& options) {
  PairMatches out;
  if (pa.px.empty() || pb.px.empty()) return out;
  const std::vector<int> forth = nearest(a, b, pa, pb, options), back = nearest(b, a, pb, pa, options);
  for (std::size_t i = 0; i < forth.size(); ++i)
    if (forth[i] >= 0 && back[static_cast<std::size_t>(forth[i])] == static_cast<int>(i))
      out.emplace_back(static_cast<int>(i), forth[i]);
  return out;
}

bool is_useful(const MatchSet& set, const ViewGroup& group) {
  std::set<int> cameras;
  for (const auto& m : set.members) cameras.insert(group.view(m.view).camera);
  return set.members.size() >= 3 && cameras.size() >= 2;
}

/// Every point with all its matches, whether or not these match each other.
std::vector<MatchSet> stars(const ViewGroup& group, const std::vector<InterestPoints>& points,
                            const MatchOptions& options) {
  std::vector<std::vector<MatchSet>> star(points.size());
  for (std::size_t v = 0; v < points.size(); ++v)
    for (std::size_t i = 0; i < points[v].px.size(); ++i)
      star[v].push_back({{{static_cast<int>(v), static_cast<int>(i)}}});
  for (int a = 0; a < group.num_views(); ++a)
    for (int b = a + 1; b < group.num_views(); ++b) {
      const auto ua = static_cast<std::size_t>(a), ub = static_cast<std::size_t>(b);
      for (const auto& [i, j] : mutual_matches(group.view(a), group.view(b), points[ua], points[ub], options)) {
        star[ua][static_cast<std::size_t>(i)].members.push_back({b, j});
        star[ub][static_cast<std::size_t>(j)].members.push_back({a, i});
      }
    }
  std::vector<MatchSet> out;
  for (auto& of_view : star)
    for (auto& set : of_view)
      if (is_useful(set, group)) out.push_back(std::move(set));
  return out;
}

}  // namespace

std::vector<MatchSet> find_match_sets(const ViewGroup& group, const std::vector<InterestPoints>& points,
                                      const MatchOptions& options) {
  std::vector<MatchSet> sets = stars(group, points, options);
  std::stable_sort(sets.begin(), sets.end(),
                   [](const MatchSet& a, const MatchSet& b) { return a.members.size() > b.members.size(); });
  std::vector<std::vector<bool>> used;
  for (const auto& p : points) used.emplace_back(p.px.size(), false);
  const auto is_used = [&](const MatchSet::Member& m) {
    return used[static_cast<std::size_t>(m.view)][static_cast<std::size_t>(m.point)];
  };
  std::vector<MatchSet> out;
  for (MatchSet& set : sets) {
    if (is_used(set.members.front())) continue;
    std::erase_if(set.members, is_used);
    if (!is_useful(set, group)) continue;
    for (const auto& m : set.members) used[static_cast<std::size_t>(m.view)][static_cast<std::size_t>(m.point)] = true;
    out.push_back(std::move(set));
  }
  return out;
}

std::vector<RayObservation> rays_of(const MatchSet& set, const ViewGroup& group,
                                    const std::vector<InterestPoints>& points) {
  std::vector<RayObservation> rays;
  for (const auto& m : set.members) {
    const View& view = group.view(m.view);
    const Eigen::Vector2d& px = points[static_cast<std::size_t>(m.view)].px[static_cast<std::size_t>(m.point)];
    rays.push_back({.origin = view.centre,
                    .direction = world_ray(view, px).normalized(),
                    .time_s = view.time_s,
                    .camera = view.camera,
                    .focal_px = view.pinhole.fx});
  }
  return rays;
}

}  // namespace vantage
