#pragma once
#include <ceres/ceres.h>

#include <array>
#include <map>
#include <string>
#include <vector>

#include "jobs/calibrate/bundle.h"
#include "jobs/calibrate/sparse_model.h"

namespace vantage {

/// All lens models as one block: f, fy/fx, cx, cy, k1, k2, p1, p2.
enum LensTerm { kF, kAspect, kCx, kCy, kK1, kK2, kP1, kP2, kNumLensTerms };
using LensBlock = std::array<double, kNumLensTerms>;
using PoseBlock = std::array<double, 6>;  ///< angle-axis, translation: cam from world

LensBlock block_of(const LensModel& lens);
void store(const LensBlock& block, LensModel& lens);
PoseBlock block_of(const RigidTransform& pose);
RigidTransform pose_of(const PoseBlock& block);

/// The model's measurements as a Ceres problem over copies of its lenses and poses and over its points in place.
/// The model must outlive it and keep its points where they are.
class BundleProblem {
 public:
  /// noise_px: of a coordinate of a measurement; sets the loss (Cauchy's at twice that) and the weight of priors.
  BundleProblem(SparseModel& model, const LensFreedom& freedom, double noise_px);
  /// First pose and the scale stay: of 7 degrees of freedom that no picture tells none is left.
  void hold_the_world();
  /// False when nothing usable came out; the model is then as before.
  bool solve();

  ceres::Problem& problem() { return problem_; }
  const std::map<std::string, LensBlock*>& lenses() const { return lenses_; }  ///< by camera; one, "", when shared
  const std::map<ImageId, PoseBlock*>& poses() const { return poses_; }
  LensBlock& lens_of(const std::string& camera) const { return *lenses_.at(freedom_.shared ? "" : camera); }

 private:
  void add_measurements(double noise_px);
  void set_lens_freedom(double noise_px);

  SparseModel& model_;
  LensFreedom freedom_;
  // Ceres sums in the order of the blocks' addresses: in a vector it is always the same.
  std::vector<LensBlock> lens_blocks_;
  std::vector<PoseBlock> pose_blocks_;
  std::map<std::string, LensBlock*> lenses_;
  std::map<ImageId, PoseBlock*> poses_;
  ceres::Problem problem_;
};

}  // namespace vantage
