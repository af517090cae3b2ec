#include "jobs/navspace/build_navspace.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "jobs/navspace/columns.h"
#include "jobs/navspace/delaunay.h"
#include "jobs/navspace/ring.h"
#include "schema/base/error.h"
#include "schema/base/median.h"

namespace vantage {
namespace {

constexpr double kVaries = 1e-6;    ///< degrees or seconds
constexpr double kFlatCell = 1e-9;  ///< volume on axes scaled to [0, 1]

using Simplices = std::vector<std::vector<int>>;

class Joiner {
 public:
  Joiner(Navspace& navspace, const NavspaceOptions& options) : nav_(navspace), options_(options) {
    report_.ring = close_ring(navspace);
    for (std::size_t v = 0; v < nav_.vertices.size(); ++v) {
      if (v == 0 || begins_column(v)) columns_.emplace_back();
      columns_.back().push_back(static_cast<int>(v));
    }
    if (columns_.size() < 2)
      throw Error(ErrorKind::BadInput, fmt::format("navspace: {} camera{} with pose and clock, needs two or more",
                                                   columns_.size(), columns_.size() == 1 ? "" : "s"));
    for (const auto& column : columns_) {
      const double n = static_cast<double>(column.size());
      Place mean;
      for (const int v : column) {
        mean.x += vertex(v).azimuth_deg / n;
        mean.y += vertex(v).elevation_deg / n;
      }
      means_.push_back(mean);
    }
  }

  NavspaceReport join() {
    report_.frozen = spread(&NavVertex::time_s) <= kVaries;
    // One moment of an arc keeps its elevations: triangles, thin as they are, unless there is no elevation at all.
    report_.arc = is_arc() && !(report_.frozen && in_a_plane_of_angles());
    if (report_.arc) flatten();
    const bool one_image_each =
        std::all_of(columns_.begin(), columns_.end(), [](const auto& c) { return c.size() == 1; });
    if (report_.frozen && report_.arc)
      join_chain();
    else if (report_.frozen || options_.cells == "delaunay" || (options_.cells == "auto" && one_image_each))
      join_delaunay();
    else
      join_columns();
    drop_flat_cells();
    if (nav_.simplices.empty())
      throw Error(ErrorKind::BadInput, "navspace: the images span no cell: no two differ in place and time");
    collect_edges();
    return report_;
  }

 private:
  NavVertex& vertex(int v) { return nav_.vertices[static_cast<std::size_t>(v)]; }

  /// Another camera, or the same one again on the other side of a ring's seam.
  bool begins_column(std::size_t v) const {
    const NavVertex &now = nav_.vertices[v], &before = nav_.vertices[v - 1];
    return now.image.camera != before.image.camera || now.azimuth_deg > before.azimuth_deg + 180;
  }

  double spread(double NavVertex::*value) const {
    const auto [low, high] = std::minmax_element(nav_.vertices.begin(), nav_.vertices.end(),
                                                 [&](const auto& a, const auto& b) { return a.*value < b.*value; });
    return *high.*value - *low.*value;
  }

  /// Spread of the cameras' mean directions across their main line against the spread along it.
  bool is_arc() const {
    Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Place& p : means_) mean += Eigen::Vector2d(p.x, p.y) / static_cast<double>(means_.size());
    for (const Place& p : means_)
      scatter += (Eigen::Vector2d(p.x, p.y) - mean) * (Eigen::Vector2d(p.x, p.y) - mean).transpose();
    const Eigen::Vector2d variance = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(scatter).eigenvalues().cwiseMax(0);
    return variance[0] <= options_.arc_ratio * options_.arc_ratio * variance[1];
  }

  /// Whether the places span more than a line of angles, by enough to triangulate them.
  bool in_a_plane_of_angles() const {
    constexpr double kWide_deg = 0.01;
    return columns_.size() > 2 && spread(&NavVertex::azimuth_deg) > kWide_deg &&
           spread(&NavVertex::elevation_deg) > kWide_deg;
  }

  /// Fixes the angle that varies less. x of means_ becomes the one that counts.
  void flatten() {
    const auto extent = [&](double Place::*value) {
      const auto [a, b] =
          std::minmax_element(means_.begin(), means_.end(), [&](auto& p, auto& q) { return p.*value < q.*value; });
      return *b.*value - *a.*value;
    };
    level_ = extent(&Place::x) >= extent(&Place::y);
    double NavVertex::*const fixed = level_ ? &NavVertex::elevation_deg : &NavVertex::azimuth_deg;
    double mean = 0;
    for (const Place& p : means_) mean += (level_ ? p.y : p.x) / static_cast<double>(means_.size());
    for (NavVertex& v : nav_.vertices) v.*fixed = mean;
    for (Place& p : means_) p = {level_ ? p.x : p.y, 0};
  }

  std::vector<int> cameras_in_order() const {
    std::vector<int> order(columns_.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return means_[static_cast<std::size_t>(a)].x < means_[static_cast<std::size_t>(b)].x;
    });
    return order;
  }

  /// Pairs along the arc, or Delaunay triangles of the cameras' mean directions.
  Simplices base_cells() const {
    Simplices base;
    if (report_.arc) {
      const std::vector<int> order = cameras_in_order();
      for (std::size_t k = 1; k < order.size(); ++k) base.push_back({order[k - 1], order[k]});
      return base;
    }
    Eigen::MatrixXd places(2, static_cast<Eigen::Index>(means_.size()));
    for (std::size_t k = 0; k < means_.size(); ++k)
      places.col(static_cast<Eigen::Index>(k)) << means_[k].x, means_[k].y;
    const Eigen::Vector2d extent = places.rowwise().maxCoeff() - places.rowwise().minCoeff();
    return delaunay(places, kFlatCell * extent.prod());
  }

  void join_chain() {
    report_.cells = "chain";
    for (const auto& pair : base_cells())
      nav_.simplices.push_back(
          {columns_[static_cast<std::size_t>(pair[0])][0], columns_[static_cast<std::size_t>(pair[1])][0]});
  }

  void join_columns() {
    report_.cells = "columns";
    ColumnTimes times_s;
    for (const auto& column : columns_) {
      times_s.emplace_back();
      for (const int v : column) times_s.back().push_back(vertex(v).time_s);
    }
    const Simplices base = base_cells();
    for (const auto& cell : base) {
      const Simplices swept = swept_cells(cell, times_s);
      report_.crossing = report_.crossing || turns_over(swept);
      nav_.simplices.insert(nav_.simplices.end(), swept.begin(), swept.end());
    }
    if (report_.crossing)
      join_delaunay();
    else if (columns_stand_still() && !report_.ring) {  // a ring has no hull at its seam
      add_fill(base, times_s, false);
      add_fill(base, times_s, true);
    }
  }

  Simplices swept_cells(const std::vector<int>& base_cell, const ColumnTimes& times_s) const {
    Simplices cells;
    for (const ColumnSimplex& simplex : sweep(base_cell, times_s)) {
      cells.emplace_back();
      for (const ColumnImage& image : simplex)
        cells.back().push_back(
            columns_[static_cast<std::size_t>(image.camera)][static_cast<std::size_t>(image.number)]);
    }
    return cells;
  }

  /// Whether held cameras move past each other, or almost: the front of a swept base cell turns over or loses most of
  /// its size, and cells overlap. cells: of one base cell; all corners but the last are the front.
  bool turns_over(const Simplices& cells) const {
    constexpr double kLeastSize = 0.2;  // of the mean
    double mean = 0, smallest = 1e300, largest = -1e300;
    for (const auto& cell : cells) {
      const double size = cell.size() == 3 ? across(cell[0], cell[1]).x()
                                           : across(cell[0], cell[1]).x() * across(cell[0], cell[2]).y() -
                                                 across(cell[0], cell[1]).y() * across(cell[0], cell[2]).x();
      mean += size / static_cast<double>(cells.size());
      smallest = std::min(smallest, size);
      largest = std::max(largest, size);
    }
    return !cells.empty() && (mean > 0 ? smallest < kLeastSize * mean : largest > kLeastSize * mean);
  }

  /// From one vertex to another, degrees; the angle that counts on an arc comes first.
  Eigen::Vector2d across(int from, int to) const {
    const NavVertex &a = nav_.vertices[static_cast<std::size_t>(from)],
                    &b = nav_.vertices[static_cast<std::size_t>(to)];
    const Eigen::Vector2d angles(b.azimuth_deg - a.azimuth_deg, b.elevation_deg - a.elevation_deg);
    return report_.arc && !level_ ? Eigen::Vector2d(angles.reverse()) : angles;
  }

  /// Cameras that start late or end early leave dents in the hull.
  void add_fill(const Simplices& base, const ColumnTimes& times_s, bool at_end) {
    std::vector<double> heights;
    for (const auto& column : times_s) heights.push_back(at_end ? -column.back() : column.front());
    for (const auto& cell : fill_to_hull(base, means_, heights)) {
      nav_.simplices.emplace_back();
      for (const int camera : cell) {
        const auto& column = columns_[static_cast<std::size_t>(camera)];
        nav_.simplices.back().push_back(at_end ? column.back() : column.front());
      }
    }
  }

  bool columns_stand_still() const {
    for (const auto& column : columns_)
      for (const int v : column) {
        const NavVertex &a = nav_.vertices[static_cast<std::size_t>(column[0])],
                        &b = nav_.vertices[static_cast<std::size_t>(v)];
        if (std::abs(a.azimuth_deg - b.azimuth_deg) > kVaries || std::abs(a.elevation_deg - b.elevation_deg) > kVaries)
          return false;
      }
    return true;
  }

  /// Rows: the coordinates that vary.
  Eigen::MatrixXd varying_places(double per_second) const {
    std::vector<std::pair<double NavVertex::*, double>> axes;
    for (const auto& [value, scale] :
         {std::pair{&NavVertex::azimuth_deg, 1.0}, {&NavVertex::elevation_deg, 1.0}, {&NavVertex::time_s, per_second}})
      if (spread(value) > kVaries) axes.emplace_back(value, scale);
    Eigen::MatrixXd places(static_cast<Eigen::Index>(axes.size()), static_cast<Eigen::Index>(nav_.vertices.size()));
    for (std::size_t v = 0; v < nav_.vertices.size(); ++v)
      for (std::size_t k = 0; k < axes.size(); ++k)
        places(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(v)) =
            axes[k].second * (nav_.vertices[v].*axes[k].first);
    return places;
  }

  void join_delaunay() {
    report_.cells = "delaunay";
    nav_.simplices = delaunay(varying_places(degrees_per_interval()), 0);
  }

  /// Median angle to the nearest other camera over the median time between successive images: a cell then has about as
  /// many cameras as moments.
  double degrees_per_interval() const {
    std::vector<double> angles, times, intervals;
    for (std::size_t a = 0; a < means_.size(); ++a) {
      double nearest = 1e300;
      for (std::size_t b = 0; b < means_.size(); ++b)
        if (a != b) nearest = std::min(nearest, std::hypot(means_[a].x - means_[b].x, means_[a].y - means_[b].y));
      angles.push_back(nearest);
    }
    for (const auto& column : columns_) {
      for (std::size_t k = 1; k < column.size(); ++k)
        intervals.push_back(nav_.vertices[static_cast<std::size_t>(column[k])].time_s -
                            nav_.vertices[static_cast<std::size_t>(column[k - 1])].time_s);
      times.push_back(nav_.vertices[static_cast<std::size_t>(column[0])].time_s);
    }
    std::sort(times.begin(), times.end());
    if (intervals.empty())
      for (std::size_t k = 1; k < times.size(); ++k)
        if (times[k] - times[k - 1] > kVaries) intervals.push_back(times[k] - times[k - 1]);
    const double angle = median(std::move(angles));
    return intervals.empty() || angle <= 0 ? 1 : angle / median(std::move(intervals));
  }

  /// Cells without volume (images of one place and time) cannot hold a point.
  void drop_flat_cells() {
    Eigen::MatrixXd places = varying_places(1);
    for (Eigen::Index row = 0; row < places.rows(); ++row)
      places.row(row) /= places.row(row).maxCoeff() - places.row(row).minCoeff();
    std::erase_if(nav_.simplices, [&](const auto& s) {
      check(static_cast<Eigen::Index>(s.size()) == places.rows() + 1,
            "a simplex has one corner more than axes that vary");
      return simplex_volume(places, s) <= kFlatCell;
    });
  }

  void collect_edges() {
    std::set<std::pair<int, int>> edges;
    std::set<int> used;
    for (auto& simplex : nav_.simplices) {
      std::sort(simplex.begin(), simplex.end());
      used.insert(simplex.begin(), simplex.end());
      for (std::size_t i = 0; i < simplex.size(); ++i)
        for (std::size_t k = i + 1; k < simplex.size(); ++k) edges.emplace(simplex[i], simplex[k]);
    }
    nav_.edges.assign(edges.begin(), edges.end());
    report_.num_unused = nav_.vertices.size() - used.size();
  }

  Navspace& nav_;
  NavspaceOptions options_;
  NavspaceReport report_;
  std::vector<std::vector<int>> columns_;  ///< vertices of each camera by time
  std::vector<Place> means_;               ///< mean direction of each camera
  bool level_ = true;                      ///< an arc's cameras differ in azimuth rather than in elevation
};

}  // namespace

NavspaceReport join_vertices(Navspace& navspace, const NavspaceOptions& options) {
  return Joiner(navspace, options).join();
}

}  // namespace vantage
