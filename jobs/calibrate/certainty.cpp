#include "jobs/calibrate/certainty.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <cmath>
#include <vector>

#include "jobs/calibrate/bundle_problem.h"

namespace vantage {
namespace {

constexpr std::size_t kMaxPictures = 250;  // dense normal equations of 1500 pose terms: seconds
constexpr int kWorldTerms = 7;             // turn, shift, size
constexpr double kStep = 1e-6;

using Generators = Eigen::Matrix<double, Eigen::Dynamic, kWorldTerms>;

/// A world turned by a small vector, scaled, shifted; the pose that sees the same in it.
RigidTransform in_world(const RigidTransform& pose, const Eigen::Matrix<double, kWorldTerms, 1>& change) {
  const Eigen::Vector3d turn = change.head<3>();
  const Eigen::Matrix3d R = turn.norm() > 0 ? Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix()
                                            : Eigen::Matrix3d::Identity();
  const Eigen::Vector3d centre = (1 + change[6]) * (R * pose.centre()) + change.segment<3>(3);
  RigidTransform out;
  out.R = pose.R * R.transpose();
  out.t = -out.R * centre;
  return out;
}

/// Where a camera is and how it is turned against a reference pose, in the world's axes: what errors are measured by.
Eigen::Matrix<double, 6, 1> place(const RigidTransform& pose, const RigidTransform& reference) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(pose.R.transpose() * reference.R));
  Eigen::Matrix<double, 6, 1> out;
  out << pose.centre(), turn.angle() * turn.axis();
  return out;
}

Eigen::Matrix<double, 6, 1> as_vector(const PoseBlock& block) {
  return Eigen::Map<const Eigen::Matrix<double, 6, 1>>(block.data());
}

/// d place / d pose block, by central differences.
Eigen::Matrix<double, 6, 6> place_by_block(const RigidTransform& pose) {
  Eigen::Matrix<double, 6, 6> out;
  for (int i = 0; i < 6; ++i) {
    PoseBlock more = block_of(pose), less = more;
    more[static_cast<std::size_t>(i)] += kStep;
    less[static_cast<std::size_t>(i)] -= kStep;
    out.col(i) = (place(pose_of(more), pose) - place(pose_of(less), pose)) / (2 * kStep);
  }
  return out;
}

/// What changes of the world do to a pose's block, and to its place.
struct WorldEffect {
  Eigen::Matrix<double, 6, kWorldTerms> block, place;
};

WorldEffect world_effect(const RigidTransform& pose) {
  WorldEffect out;
  for (int i = 0; i < kWorldTerms; ++i) {
    const Eigen::Matrix<double, kWorldTerms, 1> step = kStep * Eigen::Matrix<double, kWorldTerms, 1>::Unit(i);
    const RigidTransform more = in_world(pose, step), less = in_world(pose, -step);
    out.block.col(i) = (as_vector(block_of(more)) - as_vector(block_of(less))) / (2 * kStep);
    out.place.col(i) = (place(more, pose) - place(less, pose)) / (2 * kStep);
  }
  return out;
}

/// Normal equations of lenses and poses with all points eliminated. Column order: as asked for.
Eigen::MatrixXd reduced_normal_matrix(BundleProblem& bundle, SparseModel& model, const std::vector<double*>& blocks,
                                      int num_columns) {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = blocks;
  for (auto& point : model.points) options.parameter_blocks.push_back(point.position.data());
  ceres::CRSMatrix J;
  bundle.problem().Evaluate(options, nullptr, nullptr, nullptr, &J);
  struct OfPoint {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    std::map<int, Eigen::Vector3d> with;  // by camera column
  };
  std::vector<OfPoint> points(model.points.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(num_columns, num_columns);
  for (int row = 0; row < J.num_rows; ++row) {
    const auto begin = static_cast<std::size_t>(J.rows[static_cast<std::size_t>(row)]);
    const auto end = static_cast<std::size_t>(J.rows[static_cast<std::size_t>(row) + 1]);
    Eigen::Vector3d by_point = Eigen::Vector3d::Zero();
    int point = -1;
    for (auto i = begin; i < end; ++i)
      if (const int c = J.cols[i] - num_columns; c >= 0) {
        point = c / 3;
        by_point[c % 3] = J.values[i];
      }
    for (auto i = begin; i < end; ++i) {
      if (J.cols[i] >= num_columns) continue;
      for (auto j = begin; j < end; ++j)
        if (J.cols[j] < num_columns) H(J.cols[i], J.cols[j]) += J.values[i] * J.values[j];
      if (point >= 0) {
        auto& with =
            points[static_cast<std::size_t>(point)].with.try_emplace(J.cols[i], Eigen::Vector3d::Zero()).first->second;
        with += J.values[i] * by_point;
      }
    }
    if (point >= 0) points[static_cast<std::size_t>(point)].H += by_point * by_point.transpose();
  }
  for (const auto& p : points) {
    const Eigen::Matrix3d inverse = p.H.ldlt().solve(Eigen::Matrix3d::Identity());
    if (!inverse.allFinite()) continue;
    for (const auto& [a, with_a] : p.with)
      for (const auto& [b, with_b] : p.with) H(a, b) -= with_a.dot(inverse * with_b);
  }
  return H;
}

/// Blocks of a bundle in columns: lenses, then poses.
struct Columns {
  std::vector<double*> blocks;
  std::map<std::string, int> focal_of;  // by lens
  std::map<ImageId, int> pose_of;
  int num = 0;
};

Columns columns_of(BundleProblem& bundle) {
  Columns out;
  const auto add = [&](double* block) {
    out.blocks.push_back(block);
    const int first = out.num;
    out.num += bundle.problem().ParameterBlockTangentSize(block);
    return first;
  };
  for (const auto& [name, block] : bundle.lenses())
    if (bundle.problem().HasParameterBlock(block->data())) out.focal_of[name] = add(block->data());
  for (const auto& [image, block] : bundle.poses())
    if (bundle.problem().HasParameterBlock(block->data())) out.pose_of[image] = add(block->data());
  return out;
}

/// Errors of the places (six rows a picture) by errors of the columns, in the world that suits the centres best.
Eigen::MatrixXd aligned_places(const SparseModel& model, const Columns& columns, Generators& world_by_block) {
  const auto num = static_cast<Eigen::Index>(columns.pose_of.size());
  Eigen::MatrixXd places = Eigen::MatrixXd::Zero(6 * num, columns.num);
  Generators effect(6 * num, kWorldTerms), fitted(6 * num, kWorldTerms);
  Eigen::MatrixXd fitted_places(6 * num, columns.num);
  Eigen::Index row = 0;
  for (const auto& [image, column] : columns.pose_of) {
    const RigidTransform& pose = model.cam_from_world.at(image);
    const WorldEffect world = world_effect(pose);
    world_by_block.middleRows<6>(column) = world.block;
    places.block<6, 6>(row, column) = place_by_block(pose);
    effect.middleRows<6>(row) = world.place;
    row += 6;
  }
  // Centres decide; orientations only what centres on a line leave open.
  fitted = effect;
  fitted_places = places;
  for (Eigen::Index i = 0; i < num; ++i) {
    fitted.middleRows<3>(6 * i + 3) *= 1e-3;
    fitted_places.middleRows<3>(6 * i + 3) *= 1e-3;
  }
  return places - effect * fitted.completeOrthogonalDecomposition().solve(fitted_places);
}

/// Of a coordinate, with the freedom that the unknowns take away.
double variance_px2(const SparseModel& model, int num_columns) {
  double sum = 0;
  for (const auto& o : model.observations) sum += std::pow(error_px(model, o), 2);
  const double freedom = 2.0 * static_cast<double>(model.observations.size()) -
                         3.0 * static_cast<double>(model.points.size()) - num_columns + kWorldTerms;
  return freedom > 0 ? sum / freedom : -1;
}

}  // namespace

std::map<ImageId, CameraCertainty> certainty_of(SparseModel& model, const LensFreedom& freedom) {
  if (model.cam_from_world.size() > kMaxPictures) return {};
  // Without outliers Cauchy's loss would only weigh good measurements less: a wide one counts them all.
  BundleProblem bundle(model, freedom, 1e3 * noise_px(model));
  const Columns columns = columns_of(bundle);
  const double variance = variance_px2(model, columns.num);
  if (variance < 0) return {};
  Eigen::MatrixXd H = reduced_normal_matrix(bundle, model, columns.blocks, columns.num);
  Generators world = Generators::Zero(columns.num, kWorldTerms);
  const Eigen::MatrixXd places = aligned_places(model, columns, world);
  // Any choice of world serves, for the places do not depend on it: here the one that the generators pin down.
  world.colwise().normalize();
  H += H.diagonal().mean() * world * world.transpose();
  const Eigen::LDLT<Eigen::MatrixXd> solver(H);
  const Eigen::MatrixXd spread = variance * (places * solver.solve(places.transpose()));
  const Eigen::MatrixXd inverse = variance * solver.solve(Eigen::MatrixXd::Identity(columns.num, columns.num));
  std::map<ImageId, CameraCertainty> out;
  Eigen::Index row = 0;
  for (const auto& [image, column] : columns.pose_of) {
    const auto diagonal = spread.diagonal().segment<6>(row);
    const std::string lens = freedom.shared ? "" : image.camera;
    const int focal = columns.focal_of.at(lens);
    out[image] = {.centre_std = std::sqrt(diagonal.head<3>().sum()),
                  .rotation_std_deg = std::sqrt(diagonal.tail<3>().sum()) * 180 / M_PI,
                  .focal_std_percent = 100 * std::sqrt(inverse(focal, focal)) / bundle.lens_of(image.camera)[kF]};
    row += 6;
  }
  return out;
}

}  // namespace vantage
