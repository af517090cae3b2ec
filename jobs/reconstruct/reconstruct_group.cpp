#include "jobs/reconstruct/reconstruct_group.h"

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <cmath>

namespace vantage {
namespace {

std::vector<InterestPoints> points_of_all(const ViewGroup& group, const InterestPointOptions& options) {
  const Eigen::Vector3d up = common_up(group);
  std::vector<InterestPoints> points;
  for (const View& view : group.views) points.push_back(find_interest_points(view, up, options));
  return points;
}

/// The view to start from: of the inliers' views the one that looks along their mean direction best, later ones losing.
int central_view(const LineOfMovement& line, const MatchSet& set, const std::vector<RayObservation>& rays) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const int i : line.inliers) mean += rays[static_cast<std::size_t>(i)].direction;
  int best = line.inliers.front();
  for (const int i : line.inliers)
    if (rays[static_cast<std::size_t>(i)].direction.dot(mean) >
        rays[static_cast<std::size_t>(best)].direction.dot(mean))
      best = i;
  return set.members[static_cast<std::size_t>(best)].view;
}

PatchGuess guess_from(const ViewGroup& group, const LineOfMovement& line, int view) {
  const Eigen::Vector3d to_camera = group.view(view).centre - line.at(group.view(view).time_s);
  return {view, line.position, to_camera.normalized(), line.velocity, line.moves};
}

void plant_seeds(PatchCloud& cloud, const std::vector<MatchSet>& sets, const std::vector<InterestPoints>& points,
                 const ReconstructOptions& options, ReconstructReport& report) {
  for (std::size_t k = 0; k < sets.size(); ++k) {
    const std::vector<RayObservation> rays = rays_of(sets[k], cloud.group(), points);
    const auto line = fit_line_of_movement(rays, options.line, static_cast<std::uint32_t>(k));
    if (!line) continue;
    ++report.num_lines;
    report.num_moving_lines += line->moves;
    const PatchGuess guess = guess_from(cloud.group(), *line, central_view(*line, sets[k], rays));
    if (const auto seed = build_seed(cloud, guess, options.expansion.build)) {
      cloud.add(*seed);
      ++report.num_seeds;
    }
  }
}

Patch to_patch(const LivePatch& p, const ViewGroup& group) {
  Patch out;
  out.position = p.at(group.first_s - group.reference_time_s).cast<float>();
  out.normal = p.normal.cast<float>();
  out.velocity = p.velocity.cast<float>();
  out.t0_s = static_cast<float>(group.first_s);
  out.t1_s = static_cast<float>(group.last_s);
  out.rgb = {p.bgr[2], p.bgr[1], p.bgr[0]};
  out.score = static_cast<float>(p.score);
  out.num_views = std::popcount(p.seen);
  return out;
}

}  // namespace

Reconstruction reconstruct_group(const ViewGroup& group, const ReconstructOptions& options,
                                 const std::function<void(double, const std::string&)>& progress) {
  Reconstruction out;
  if (group.num_views() < 3 || group.num_cameras < 2) return out;
  progress(0.0, "interest points");
  const std::vector<InterestPoints> points = points_of_all(group, options.points);
  for (const auto& p : points) out.report.num_points += static_cast<int>(p.px.size());
  progress(0.03, "matching");
  const std::vector<MatchSet> sets = find_match_sets(group, points, options.match);
  out.report.num_match_sets = static_cast<int>(sets.size());
  progress(0.15, "seeds");
  PatchCloud cloud(group, options.cell_px);
  plant_seeds(cloud, sets, points, options, out.report);
  for (int i = 0; i < options.iterations; ++i) {
    const double from = 0.2 + 0.8 * i / options.iterations, share = 0.8 / options.iterations;
    const ExpansionReport grown = expand(
        cloud, options.expansion, [&](double covered) { progress(from + share * std::min(1.0, covered), "growing"); });
    out.report.coverage = grown.coverage;
    out.report.num_tried += grown.num_tried;
    out.report.num_set_in_motion += spread_motion(cloud, options.expansion.build);
    out.report.num_filtered += filter(cloud, options.filter).total();
  }
  for (int i = 0; i < options.smoothing_rounds; ++i) smooth_velocities(cloud, options.filter.window_cells);
  for (const LivePatch& p : cloud.patches()) {
    out.patches.push_back(to_patch(p, group));
    out.report.num_moving += p.moves;
  }
  out.report.num_patches = static_cast<int>(out.patches.size());
  return out;
}

}  // namespace vantage
