#include "jobs/navspace/delaunay.h"

#include <fmt/format.h>
#include <libqhull_r/libqhull_r.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "schema/base/error.h"

namespace vantage {
namespace {

/// Qhull's state; freed also when an exception passes.
class Hull {
 public:
  Hull() : messages_(std::tmpfile(), &std::fclose) {
    if (!messages_) throw Error(ErrorKind::Resource, "no temporary file for Qhull's messages");
    qh_zero(&qh_, messages_.get());
  }
  ~Hull() {
    qh_freeqhull(&qh_, !qh_ALL);
    int kept = 0, total = 0;
    qh_memfreeshort(&qh_, &kept, &total);
  }
  Hull(const Hull&) = delete;
  Hull& operator=(const Hull&) = delete;

  qhT* get() { return &qh_; }
  FILE* messages() { return messages_.get(); }

 private:
  std::unique_ptr<FILE, int (*)(FILE*)> messages_;
  qhT qh_{};
};

std::vector<int> corners_of(qhT* qh, facetT* facet) {
  std::vector<int> corners;
  vertexT *vertex, **vertexp;
  FOREACHvertex_(facet->vertices) corners.push_back(qh_pointid(qh, vertex->point));
  std::sort(corners.begin(), corners.end());
  return corners;
}

}  // namespace

double simplex_volume(const Eigen::MatrixXd& points, const std::vector<int>& corners) {
  const auto d = static_cast<Eigen::Index>(corners.size()) - 1;
  Eigen::MatrixXd edges(points.rows(), d);
  for (Eigen::Index k = 0; k < d; ++k)
    edges.col(k) = points.col(corners[static_cast<std::size_t>(k + 1)]) - points.col(corners[0]);
  return std::abs(edges.determinant()) / std::tgamma(static_cast<double>(d) + 1);
}

std::vector<std::vector<int>> delaunay(const Eigen::MatrixXd& points, double min_volume) {
  const auto dimension = static_cast<int>(points.rows()), count = static_cast<int>(points.cols());
  check(dimension == 2 || dimension == 3, "triangulations are of the plane or of space");
  Eigen::MatrixXd coordinates = points;  // Qhull wants them writable, point by point: Eigen's columns
  Hull hull;
  char options[] = "qhull d Qt Qbb Qz";
  const int rc = count <= dimension ? qh_ERRinput
                                    : qh_new_qhull(hull.get(), dimension, count, coordinates.data(), False, options,
                                                   nullptr, hull.messages());
  if (rc != 0)
    throw Error(ErrorKind::BadInput,
                fmt::format("navspace: {} image places cannot be triangulated in {} dimensions (Qhull error {}): "
                            "they lie on a line or in a plane",
                            count, dimension, rc));
  qhT* qh = hull.get();
  std::vector<std::vector<int>> simplices;
  facetT* facet;
  FORALLfacets {
    if (facet->upperdelaunay) continue;
    std::vector<int> corners = corners_of(qh, facet);
    if (corners.back() >= count) continue;  // the point at infinity that Qz adds
    if (simplex_volume(points, corners) > min_volume) simplices.push_back(std::move(corners));
  }
  std::sort(simplices.begin(), simplices.end());
  return simplices;
}

}  // namespace vantage
