#pragma once
/// Which correspondences tell an image's depth. Light: the plan of correspond, of depth and of their dependencies.
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "schema/formats/navspace.h"
#include "schema/shot/shot.h"

namespace vantage {

/// An image seen from elsewhere. step: a frame of the same camera next to `other` in time, joined to it by an edge,
/// that tells how things move in `other` (time-corrected triangulation); empty when both images are of one moment, or
/// when there is none.
struct DepthEdge {
  int other = 0;
  std::optional<int> step;
};

class DepthEdges {
 public:
  /// A static camera's own frames tell nothing of depth; a moving one's do.
  DepthEdges(const Navspace& navspace, const Shot& shot);
  /// By rising `other`.
  std::vector<DepthEdge> of(int vertex) const;
  /// Of wanted: the frames of the same camera next before and next after, joined to it by an edge; at most one each.
  std::vector<int> frames_around(int vertex, const std::set<int>& wanted) const;
  /// Edges (first < second) that the depth map of a vertex is made from when those of `wanted` are made, too.
  std::set<std::pair<int, int>> needed_by(int vertex, const std::set<int>& wanted) const;

 private:
  std::optional<int> step_towards(int vertex, double time_s) const;

  const Navspace& navspace_;
  std::set<std::string> moving_;
  std::vector<std::vector<int>> neighbours_;  ///< rising
};

/// "correspond/<first>__<second>".
std::string correspond_job_name(const Navspace& navspace, int a, int b);

}  // namespace vantage
