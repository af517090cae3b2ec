#include "jobs/align/joint_tracks.h"

#include <algorithm>
#include <map>
#include <set>

#include "schema/formats/shutter.h"

namespace vantage::align {
namespace {

constexpr std::size_t kMinSamples = 4;

struct Node {
  std::size_t camera = 0;
  int track = 0;
  auto operator<=>(const Node&) const = default;
};

/// What moves `leaf` onto the point of another track: a straight line between two corrections, by the footage time of
/// the match's second camera.
struct Link {
  Node leaf;
  std::size_t timed_by = 0;
  double first_s = 0, last_s = 0;
  Eigen::Vector2d first_px, last_px;
};

class Joiner {
 public:
  Joiner(const std::vector<JointCamera>& cameras, const std::vector<CameraTracks>& tracks,
         const std::vector<PairTracks>& pairs)
      : cameras_(cameras), tracks_(tracks) {
    for (const PairTracks& pair : pairs)
      for (const SharedTrack& m : pair.shared) add(pair, m);
  }

  std::vector<MovingPoint> join(std::size_t max_points) const {
    std::vector<MovingPoint> points;
    std::set<Node> used;
    for (const Node& centre : by_company()) {
      if (points.size() == max_points) break;
      if (used.contains(centre)) continue;
      MovingPoint point = trimmed(around(centre, used));
      if (point.tracks.size() >= 2) points.push_back(std::move(point));
    }
    return points;
  }

 private:
  const Track& track(const Node& node) const {
    return tracks_[node.camera].tracks.tracks.at(static_cast<std::size_t>(node.track));
  }
  double footage_s(std::size_t camera, int frame) const {
    return tracks_[camera].table.pts_s.at(static_cast<std::size_t>(frame));
  }

  void add(const PairTracks& pair, const SharedTrack& m) {
    const Node a{pair.a, m.a}, b{pair.b, m.b};
    const double first = footage_s(pair.b, track(b).first_frame), last = footage_s(pair.b, track(b).last_frame());
    links_[a].push_back({b, pair.b, first, last, m.first_px, m.last_px});
    links_[b].push_back({a, pair.b, first, last, -m.first_px, -m.last_px});
  }

  std::size_t num_cameras(const Node& node) const {
    std::set<std::size_t> cameras;
    for (const Link& link : links_.at(node)) cameras.insert(link.leaf.camera);
    return cameras.size();
  }

  std::vector<Node> by_company() const {
    std::vector<Node> nodes;
    for (const auto& [node, links] : links_) nodes.push_back(node);
    std::stable_sort(nodes.begin(), nodes.end(), [&](const Node& p, const Node& q) {
      return std::pair(num_cameras(p), track(p).px.size()) > std::pair(num_cameras(q), track(q).px.size());
    });
    return nodes;
  }

  MovingTrack path_of(const Node& node) const {
    MovingTrack out{.camera = node.camera, .times_s = {}, .px = {}};
    for (std::size_t k = 0; k < track(node).px.size(); ++k) {
      const Eigen::Vector2d px = track(node).px[k].cast<double>();
      const CameraTracks& camera = tracks_[node.camera];
      out.times_s.push_back(footage_s(node.camera, track(node).first_frame + static_cast<int>(k)) +
                            row_delay_s(px.y(), camera.tracks.height, camera.readout_s));
      out.px.push_back(px);
    }
    return out;
  }

  MovingTrack moved(const Link& link) const {
    MovingTrack out = path_of(link.leaf);
    const CameraClock &own = cameras_[link.leaf.camera].clock, &timing = cameras_[link.timed_by].clock;
    for (std::size_t k = 0; k < out.px.size(); ++k) {
      const double time_s = (own.shot_time_s(out.times_s[k]) - timing.offset_s) / timing.rate;
      const double u = std::clamp((time_s - link.first_s) / std::max(link.last_s - link.first_s, 1e-9), 0.0, 1.0);
      out.px[k] += (1 - u) * link.first_px + u * link.last_px;
    }
    return out;
  }

  static bool meet(const MovingTrack& p, const MovingTrack& q) {
    return p.camera == q.camera && p.times_s.front() <= q.times_s.back() && q.times_s.front() <= p.times_s.back();
  }

  MovingPoint around(const Node& centre, std::set<Node>& used) const {
    MovingPoint point{{path_of(centre)}};
    used.insert(centre);
    std::vector<Link> links = links_.at(centre);
    std::stable_sort(links.begin(), links.end(),
                     [&](const Link& p, const Link& q) { return track(p.leaf).px.size() > track(q.leaf).px.size(); });
    for (const Link& link : links) {
      if (used.contains(link.leaf)) continue;
      MovingTrack leaf = moved(link);
      if (std::any_of(point.tracks.begin(), point.tracks.end(), [&](const auto& t) { return meet(t, leaf); })) continue;
      used.insert(link.leaf);
      point.tracks.push_back(std::move(leaf));
    }
    return point;
  }

  bool sees(const MovingTrack& track, double time_s) const {
    const JointCamera& camera = cameras_[track.camera];
    return time_s >= camera.clock.shot_time_s(track.times_s.front()) - camera.frame_s &&
           time_s <= camera.clock.shot_time_s(track.times_s.back()) + camera.frame_s;
  }

  MovingPoint trimmed(const MovingPoint& point) const {
    MovingPoint out;
    for (const MovingTrack& whole : point.tracks) {
      MovingTrack kept{.camera = whole.camera, .times_s = {}, .px = {}};
      for (std::size_t k = 0; k < whole.px.size(); ++k) {
        const double time_s = cameras_[whole.camera].clock.shot_time_s(whole.times_s[k]);
        if (std::none_of(point.tracks.begin(), point.tracks.end(),
                         [&](const MovingTrack& other) { return other.camera != whole.camera && sees(other, time_s); }))
          continue;
        kept.times_s.push_back(whole.times_s[k]);
        kept.px.push_back(whole.px[k]);
      }
      if (kept.px.size() >= kMinSamples) out.tracks.push_back(std::move(kept));
    }
    return out;
  }

  const std::vector<JointCamera>& cameras_;
  const std::vector<CameraTracks>& tracks_;
  std::map<Node, std::vector<Link>> links_;
};

}  // namespace

std::vector<MovingPoint> join_tracks(const std::vector<JointCamera>& cameras, const std::vector<CameraTracks>& tracks,
                                     const std::vector<PairTracks>& pairs, std::size_t max_points) {
  return Joiner(cameras, tracks, pairs).join(max_points);
}

}  // namespace vantage::align
