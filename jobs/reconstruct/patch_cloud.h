#pragma once
#include <Eigen/Core>
#include <vector>

#include "jobs/reconstruct/photometry.h"
#include "jobs/reconstruct/view_group.h"

namespace vantage {

/// A patch under construction: Klose et al. 2011, §6. Times are relative to the group's reference time.
struct LivePatch {
  int reference = 0;                                   ///< view it was refined in
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< at t = 0
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   ///< unit, towards the reference camera
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  bool moves = false;  ///< false: velocity is exactly 0
  ViewSet seen = 0;    ///< views that agree with it, the reference among them
  double score = 0;    ///< mean NCC of the reference with the others
  double radius = 0;   ///< width of a cell at its depth, world units
  cv::Vec3b bgr;
  bool alive = true;
  Eigen::Vector3d at(double time_s) const { return position + time_s * velocity; }
  bool seen_in(int view) const { return (seen >> view) & 1U; }
};

/// Eq. 9 of the paper, with magnitudes: whether each patch lies near the other's plane. kappa: world units.
bool lie_on_one_surface(const LivePatch& a, const LivePatch& b, double time_s, double kappa);

/// A grid over one view. Cells are cell_px wide; a cell knows the nearest patch seen through it.
struct CellMap {
  int cols = 0, rows = 0;
  std::vector<int> nearest;             ///< patch, or -1
  std::vector<float> depth;             ///< of that patch
  std::vector<unsigned char> tried[2];  ///< expansions into the cell that failed: static, moving
};

/// Patches and, for every view, which cells they fill. Patches are numbered in order of birth.
class PatchCloud {
 public:
  PatchCloud(const ViewGroup& group, int cell_px);
  const ViewGroup& group() const { return *group_; }
  int cell_px() const { return cell_px_; }
  const std::vector<LivePatch>& patches() const { return patches_; }
  const LivePatch& patch(int i) const { return patches_[static_cast<std::size_t>(i)]; }
  LivePatch& patch(int i) { return patches_[static_cast<std::size_t>(i)]; }
  CellMap& map(int view) { return maps_[static_cast<std::size_t>(view)]; }
  const CellMap& map(int view) const { return maps_[static_cast<std::size_t>(view)]; }

  /// Index of the cell that holds a pixel of the view; -1 outside the image.
  int cell_at(int view, const Eigen::Vector2d& px) const;
  /// Where a patch of a cell is started: a point in its middle half, the same in all cells of a group. Groups differ,
  /// so that together they sample what stands still more finely than one.
  Eigen::Vector2d cell_point(int view, int cell) const;
  /// Cell of a patch in a view at that view's time; -1 outside.
  int cell_of(const LivePatch& patch, int view) const;
  /// Width of a cell at a depth, world units.
  double cell_width(int view, double depth) const { return cell_px_ * depth / group_->view(view).pinhole.fx; }
  /// Whether some patch lies clearly (4 cell widths) in front of a point that projects into this cell.
  bool is_hidden(int view, int cell, double depth) const;

  int add(LivePatch patch);
  /// Forgets dead patches; numbers change. Failed expansions stay on record.
  void rebuild();
  /// Cells of a view that a patch is seen through.
  std::size_t num_filled(int view) const;

 private:
  void mark(int patch);
  void make_maps();

  const ViewGroup* group_;
  int cell_px_;
  Eigen::Vector2d point_in_cell_;  ///< in cells
  std::vector<LivePatch> patches_;
  std::vector<CellMap> maps_;
};

}  // namespace vantage
