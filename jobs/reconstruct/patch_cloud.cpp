#include "jobs/reconstruct/patch_cloud.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vantage {

namespace {

/// The R2 sequence (Roberts 2018): successive numbers fill the square evenly.
Eigen::Vector2d point_in_cell(int number) {
  const double x = 0.5 + number * 0.7548776662466927, y = 0.5 + number * 0.5698402909980532;
  return Eigen::Vector2d(0.25 + 0.5 * (x - std::floor(x)), 0.25 + 0.5 * (y - std::floor(y)));
}

}  // namespace

bool lie_on_one_surface(const LivePatch& a, const LivePatch& b, double time_s, double kappa) {
  const Eigen::Vector3d between = b.at(time_s) - a.at(time_s);
  return std::abs(between.dot(a.normal)) + std::abs(between.dot(b.normal)) < kappa;
}

PatchCloud::PatchCloud(const ViewGroup& group, int cell_px)
    : group_(&group), cell_px_(cell_px), point_in_cell_(point_in_cell(group.views.front().id.frame)) {
  make_maps();
}

void PatchCloud::make_maps() {
  for (const View& view : group_->views) {
    CellMap map;
    map.cols = (view.pinhole.width + cell_px_ - 1) / cell_px_;
    map.rows = (view.pinhole.height + cell_px_ - 1) / cell_px_;
    const auto count = static_cast<std::size_t>(map.cols) * static_cast<std::size_t>(map.rows);
    map.nearest.assign(count, -1);
    map.depth.assign(count, std::numeric_limits<float>::infinity());
    for (auto& tried : map.tried) tried.assign(count, 0);
    maps_.push_back(std::move(map));
  }
}

int PatchCloud::cell_at(int view, const Eigen::Vector2d& px) const {
  if (!inside(group_->view(view), px, 0)) return -1;
  return static_cast<int>(px.y()) / cell_px_ * map(view).cols + static_cast<int>(px.x()) / cell_px_;
}

Eigen::Vector2d PatchCloud::cell_point(int view, int cell) const {
  const int cols = map(view).cols;
  return cell_px_ * (Eigen::Vector2d(cell % cols, cell / cols) + point_in_cell_);
}

int PatchCloud::cell_of(const LivePatch& patch, int view) const {
  return cell_at(view, project(group_->view(view), patch.at(group_->view(view).time_s)).px);
}

bool PatchCloud::is_hidden(int view, int cell, double depth) const {
  const double front = map(view).depth[static_cast<std::size_t>(cell)];
  return front + 4 * cell_width(view, depth) < depth;
}

int PatchCloud::add(LivePatch patch) {
  patches_.push_back(std::move(patch));
  mark(static_cast<int>(patches_.size()) - 1);
  return static_cast<int>(patches_.size()) - 1;
}

void PatchCloud::mark(int index) {
  const LivePatch& p = patch(index);
  for (int v = 0; v < group_->num_views(); ++v) {
    if (!p.seen_in(v)) continue;
    const Projection at = project(group_->view(v), p.at(group_->view(v).time_s));
    const int cell = cell_at(v, at.px);
    if (cell < 0) continue;
    const auto c = static_cast<std::size_t>(cell);
    if (at.depth >= static_cast<double>(map(v).depth[c])) continue;
    map(v).depth[c] = static_cast<float>(at.depth);
    map(v).nearest[c] = index;
  }
}

void PatchCloud::rebuild() {
  std::erase_if(patches_, [](const LivePatch& p) { return !p.alive; });
  for (CellMap& map : maps_) {
    std::fill(map.nearest.begin(), map.nearest.end(), -1);
    std::fill(map.depth.begin(), map.depth.end(), std::numeric_limits<float>::infinity());
  }
  for (std::size_t i = 0; i < patches_.size(); ++i) mark(static_cast<int>(i));
}

std::size_t PatchCloud::num_filled(int view) const {
  const auto& nearest = map(view).nearest;
  return nearest.size() - static_cast<std::size_t>(std::count(nearest.begin(), nearest.end(), -1));
}

}  // namespace vantage
