#include "jobs/reconstruct/match_sets.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
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
  /// What a pixel of a says of b's pixels: a line of unit normal, or a point in the first two numbers.
  Eigen::Vector3d at(const Eigen::Vector2d& px) const {
    const Eigen::Vector3d image = transfer_ * px.homogeneous();
    return image / (same_place_ ? image.z() : std::max(1e-12, image.head<2>().norm()));
  }
  bool admits(const Eigen::Vector3d& at, const Eigen::Vector2d& q) const {
    if (same_place_) return (q - at.head<2>()).squaredNorm() <= reach_px_ * reach_px_;
    return std::abs(at.x() * q.x() + at.y() * q.y() + at.z()) <= reach_px_;
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

/// Two points that may match and the squared distance of their descriptors.
struct Candidate {
  int i, j;
  float distance2;
};

std::vector<Candidate> candidates(const View& a, const View& b, const InterestPoints& pa, const InterestPoints& pb,
                                  const MatchOptions& options) {
  const Gate gate(a, b, options);
  std::vector<Candidate> out;
  for (int i = 0; i < static_cast<int>(pa.px.size()); ++i) {
    const Eigen::Vector3d at = gate.at(pa.px[static_cast<std::size_t>(i)]);
    for (int j = 0; j < static_cast<int>(pb.px.size()); ++j)
      if (gate.admits(at, pb.px[static_cast<std::size_t>(j)]))
        out.push_back({i, j, descriptor_distance2(pa.descriptors, i, pb.descriptors, j)});
  }
  return out;
}

/// The nearest partner of a point, and the next that is not within 3 px of it: such a one is the same thing.
struct Best {
  int partner = -1;
  float first = std::numeric_limits<float>::infinity();
  float second = 2;  ///< unit descriptors with no negative entries are at most sqrt(2) apart
  void offer(int other, float distance2) {
    if (distance2 < first) {
      first = distance2;
      partner = other;
    }
  }
  void offer_second(int other, float distance2, const std::vector<Eigen::Vector2d>& px) {
    const auto apart = px[static_cast<std::size_t>(other)] - px[static_cast<std::size_t>(partner)];
    if (distance2 < second && apart.squaredNorm() > 9) second = distance2;
  }
  bool is_distinct(double max_ratio) const { return first < max_ratio * max_ratio * static_cast<double>(second); }
};

PairMatches mutual_matches(const View& a, const View& b, const InterestPoints& pa, const InterestPoints& pb,
                           const MatchOptions& options) {
  std::vector<Best> of_a(pa.px.size()), of_b(pb.px.size());
  const std::vector<Candidate> all = candidates(a, b, pa, pb, options);
  for (const Candidate& c : all) {
    of_a[static_cast<std::size_t>(c.i)].offer(c.j, c.distance2);
    of_b[static_cast<std::size_t>(c.j)].offer(c.i, c.distance2);
  }
  for (const Candidate& c : all) {
    of_a[static_cast<std::size_t>(c.i)].offer_second(c.j, c.distance2, pb.px);
    of_b[static_cast<std::size_t>(c.j)].offer_second(c.i, c.distance2, pa.px);
  }
  PairMatches out;
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    if (of_a[i].partner < 0 || !of_a[i].is_distinct(options.max_ratio)) continue;
    const Best& back = of_b[static_cast<std::size_t>(of_a[i].partner)];
    if (back.partner == static_cast<int>(i) && back.is_distinct(options.max_ratio))
      out.emplace_back(static_cast<int>(i), of_a[i].partner);
  }
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
