#pragma once
#include <Eigen/Core>
#include <array>
#include <map>

namespace vantage::sync {

/// Which data may err together: a cell of a camera's picture (column, row) and a stretch of its time. What neighbouring
/// points of one thing share (shading, perspective, the thing's bending, look-alikes) is no independent evidence.
using Cluster = std::array<long, 3>;

/// Cells as large as things that move as one: a twelfth of the picture's width, a second.
Cluster cluster_at(const Eigen::Vector2d& px, double time_s, int picture_width_px);

/// What a cluster adds to weighted normal equations H · step = -g, at the solution.
struct NormalPart {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};
using ClusterParts = std::map<Cluster, NormalPart>;
void add_part(ClusterParts& parts, const Cluster& cluster, const Eigen::MatrixXd& H, const Eigen::VectorXd& g);

/// Covariance of the unknowns from how far each moves when one cluster is left out (jackknife over clusters: Bell &
/// McCaffrey 2002, "CR3"). Unlike the sandwich it does not shrink when few clusters bear the answer, each of which has
/// pulled the solution towards itself. H: the whole matrix, of which data outside all clusters may be a part; its
/// directions that no data fix stay out.
Eigen::MatrixXd jackknife_covariance(const ClusterParts& parts, const Eigen::MatrixXd& H);

/// (Σ information)² / Σ information² over clusters, about a change of the unknowns along `direction`.
double effective_clusters(const ClusterParts& parts, const Eigen::VectorXd& direction);

/// Half-width of the interval that holds 68 % of Student's distribution, over the normal distribution's: what a
/// standard deviation that was itself estimated from few clusters must be multiplied by. At least one degree of freedom
/// is assumed.
double student_factor(double degrees_of_freedom);

/// Inverse of a symmetric matrix on the directions that the data fix.
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& H);

}  // namespace vantage::sync
