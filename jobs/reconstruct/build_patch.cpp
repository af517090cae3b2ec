#include "jobs/reconstruct/build_patch.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace vantage {
namespace {

/// How a view agrees with a patch.
struct ViewScore {
  int view;
  double ncc;
};

double cosine_of(double degrees) { return std::cos(degrees * std::numbers::pi / 180); }

/// Whether a view can see the patch by geometry alone: facing it, inside the image, nothing in front.
bool may_see(const PatchCloud& cloud, int view_index, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
             double min_cosine) {
  const View& view = cloud.group().view(view_index);
  const Eigen::Vector3d to_camera = view.centre - point;
  if (normal.dot(to_camera) < min_cosine * to_camera.norm()) return false;
  const Projection at = project(view, point);
  const int cell = at.depth > 0 ? cloud.cell_at(view_index, at.px) : -1;
  return cell >= 0 && !cloud.is_hidden(view_index, cell, at.depth);
}

/// Views to compare with. Static patches: every camera's main view and all of the reference's own camera: more frames
/// of the others would say nothing new. Moving ones: all.
bool is_of_interest(const ViewGroup& group, int view, int reference, bool moves) {
  return view != reference &&
         (moves || group.view(view).main || group.view(view).camera == group.view(reference).camera);
}

/// Correlation of the views of interest that may see the plane. Those whose correlation cannot be computed (border, no
/// texture) are left out.
std::vector<ViewScore> score_views(const PatchCloud& cloud, const ReferenceTexture& texture, const TangentPlane& plane,
                                   bool moves, double max_angle_deg) {
  const ViewGroup& group = cloud.group();
  const Eigen::Vector3d normal = normal_of(group, plane), centre = centre_at_reference_time(group, plane);
  const double reference_time = group.view(plane.reference).time_s;
  std::vector<ViewScore> scores;
  for (int v = 0; v < group.num_views(); ++v) {
    if (!is_of_interest(group, v, plane.reference, moves)) continue;
    const Eigen::Vector3d point = centre + (group.view(v).time_s - reference_time) * plane.velocity;
    if (!may_see(cloud, v, point, normal, cosine_of(max_angle_deg))) continue;
    if (const auto c = texture.compare(plane, v, false)) scores.push_back({v, c->ncc});
  }
  return scores;
}

/// Best score of each other camera, best first.
std::vector<ViewScore> best_per_camera(const ViewGroup& group, const std::vector<ViewScore>& scores, int own_camera,
                                       double least) {
  std::vector<ViewScore> best(static_cast<std::size_t>(group.num_cameras), {-1, least});
  for (const ViewScore& s : scores) {
    ViewScore& b = best[static_cast<std::size_t>(group.view(s.view).camera)];
    if (s.ncc > b.ncc) b = s;
  }
  best[static_cast<std::size_t>(own_camera)].view = -1;
  std::erase_if(best, [](const ViewScore& s) { return s.view < 0; });
  std::stable_sort(best.begin(), best.end(), [](const ViewScore& a, const ViewScore& b) { return a.ncc > b.ncc; });
  return best;
}

/// First and last usable view of a camera.
void add_ends_of_camera(const ViewGroup& group, const std::vector<ViewScore>& scores, int camera, double least,
                        std::vector<int>& out) {
  int first = -1, last = -1;
  for (const ViewScore& s : scores) {
    if (group.view(s.view).camera != camera || s.ncc < least) continue;
    if (first < 0 || group.view(s.view).time_s < group.view(first).time_s) first = s.view;
    if (last < 0 || group.view(s.view).time_s > group.view(last).time_s) last = s.view;
  }
  if (first >= 0) out.push_back(first);
  if (last >= 0 && last != first) out.push_back(last);
}

/// Views to refine with. Static: one per camera, since more frames of a camera say nothing new. Moving: the ends in
/// time of each camera, the reference's own among them: they carry the velocity.
std::vector<int> refinement_views(const ViewGroup& group, const std::vector<ViewScore>& scores, const PatchGuess& guess,
                                  const BuildOptions& options) {
  const int own = group.view(guess.reference).camera;
  std::vector<ViewScore> cameras = best_per_camera(group, scores, own, options.start_ncc);
  if (cameras.size() > static_cast<std::size_t>(options.max_cameras))
    cameras.resize(static_cast<std::size_t>(options.max_cameras));
  std::vector<int> views;
  for (const ViewScore& s : cameras) {
    if (guess.moves)
      add_ends_of_camera(group, scores, group.view(s.view).camera, options.start_ncc, views);
    else
      views.push_back(s.view);
  }
  if (views.empty()) return views;
  if (guess.moves) add_ends_of_camera(group, scores, own, options.start_ncc, views);
  return views;
}

/// A static point looks the same in the other frames of its own camera, but where something passes in front: there the
/// viewpoint is the same, so these must agree about as well as the other cameras do.
bool stands_still(const ViewGroup& group, const std::vector<ViewScore>& scores, int reference, double least_ncc) {
  int agree = 0, all = 0;
  for (const ViewScore& s : scores)
    if (group.view(s.view).camera == group.view(reference).camera) {
      ++all;
      agree += s.ncc >= least_ncc;
    }
  return 2 * agree >= all;
}

/// Whether the views that see a moving patch agree less when it is held still.
bool moves_visibly(const ReferenceTexture& texture, const TangentPlane& plane, const std::vector<ViewScore>& scores,
                   double seen_ncc) {
  constexpr double kMinGain = 0.004;  // a velocity fitted to noise gains less
  TangentPlane held = plane;
  held.velocity.setZero();
  double gain = 0;
  int count = 0;
  for (const ViewScore& s : scores) {
    if (s.ncc < seen_ncc) continue;
    const auto c = texture.compare(held, s.view, false);
    gain += s.ncc - (c ? c->ncc : 0.0);
    ++count;
  }
  return gain > kMinGain * count;
}

bool is_too_fast(const View& view, const TangentPlane& plane, double max_speed_widths) {
  const double px_per_second = plane.velocity.norm() * view.pinhole.fx * plane.inverse_depth;
  return px_per_second > max_speed_widths * view.pinhole.width;
}

struct Support {
  ViewSet seen = 0;
  int num_views = 1, num_cameras = 1, num_times = 1;
  double mean_ncc = 0;
};

Support support_of(const ViewGroup& group, const std::vector<ViewScore>& scores, int reference, double seen_ncc) {
  Support s;
  s.seen = ViewSet{1} << reference;
  std::set<int> cameras{group.view(reference).camera};
  std::set<double> times{group.view(reference).time_s};
  double sum = 0;
  for (const ViewScore& score : scores) {
    if (score.ncc < seen_ncc) continue;
    s.seen |= ViewSet{1} << score.view;
    ++s.num_views;
    sum += score.ncc;
    cameras.insert(group.view(score.view).camera);
    times.insert(group.view(score.view).time_s);
  }
  s.num_cameras = static_cast<int>(cameras.size());
  s.num_times = static_cast<int>(times.size());
  s.mean_ncc = s.num_views > 1 ? sum / (s.num_views - 1) : 0;
  return s;
}

LivePatch live_patch(const PatchCloud& cloud, const TangentPlane& plane, const Support& support, bool moves) {
  const ViewGroup& group = cloud.group();
  const View& view = group.view(plane.reference);
  LivePatch p;
  p.reference = plane.reference;
  p.velocity = moves ? plane.velocity : Eigen::Vector3d::Zero();
  p.position = centre_at_reference_time(group, plane) - view.time_s * p.velocity;
  p.normal = normal_of(group, plane);
  p.moves = moves;
  p.seen = support.seen;
  p.score = support.mean_ncc;
  p.radius = cloud.cell_width(plane.reference, 1 / plane.inverse_depth);
  p.bgr = view.bgr(static_cast<int>(plane.px.y()), static_cast<int>(plane.px.x()));
  return p;
}

/// Motion of the patch during the group, in pixels of its reference view.
double motion_px(const PatchCloud& cloud, const LivePatch& p) {
  return p.velocity.norm() * cloud.group().duration_s() / p.radius * cloud.cell_px();
}

}  // namespace

std::optional<LivePatch> build_patch(const PatchCloud& cloud, const PatchGuess& guess, const BuildOptions& options) {
  const ViewGroup& group = cloud.group();
  const View& reference = group.view(guess.reference);
  const Eigen::Vector3d velocity = guess.moves ? guess.velocity : Eigen::Vector3d::Zero();
  const auto start =
      tangent_plane(group, guess.reference, guess.position + reference.time_s * velocity, guess.normal, velocity);
  if (!start) return std::nullopt;
  const auto texture = ReferenceTexture::sample(group, guess.reference, start->px);
  if (!texture) return std::nullopt;

  const auto first_scores = score_views(cloud, *texture, *start, guess.moves, options.max_angle_deg);
  const std::vector<int> views = refinement_views(group, first_scores, guess, options);
  if (views.empty()) return std::nullopt;
  RefineOptions refine_options = options.refine;
  refine_options.with_velocity = guess.moves;
  const TangentPlane plane = refine(*texture, *start, views, refine_options).plane;
  if (!(plane.inverse_depth > 0)) return std::nullopt;

  const Eigen::Vector3d to_camera = reference.centre - centre_at_reference_time(group, plane);
  if (normal_of(group, plane).dot(to_camera) < cosine_of(options.max_angle_deg + 10) * to_camera.norm())
    return std::nullopt;
  const auto scores = score_views(cloud, *texture, plane, guess.moves, options.max_angle_deg + 10);
  const Support support = support_of(group, scores, guess.reference, options.seen_ncc);
  const int min_views = options.min_views + (guess.moves ? options.extra_views_moving : 0);
  if (support.num_views < min_views || support.num_cameras < 2 || support.mean_ncc < options.min_ncc)
    return std::nullopt;
  if (guess.moves && is_too_fast(reference, plane, options.max_speed_widths)) return std::nullopt;
  const bool consistent =
      guess.moves ? support.num_times >= 2 && moves_visibly(*texture, plane, scores, options.seen_ncc)
                  : stands_still(group, scores, guess.reference, std::max(options.seen_ncc, support.mean_ncc - 0.02));
  if (!consistent) return std::nullopt;
  return live_patch(cloud, plane, support, guess.moves);
}

std::optional<LivePatch> build_seed(const PatchCloud& cloud, const PatchGuess& guess, const BuildOptions& options) {
  constexpr double kMinMotionPx = 0.5, kMinGain = 0.01;
  PatchGuess still = guess, moving = guess;
  still.moves = false;
  moving.moves = true;
  const auto s = build_patch(cloud, still, options);
  if (cloud.group().duration_s() <= 0) return s;
  const auto m = build_patch(cloud, moving, options);
  if (!m || motion_px(cloud, *m) < kMinMotionPx) return s;
  if (!s) return guess.moves ? m : std::nullopt;  // only the rays can vouch for a motion that the images alone suggest
  return m->score > s->score + kMinGain ? m : s;
}

}  // namespace vantage
