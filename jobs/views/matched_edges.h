#pragma once
#include <utility>
#include <vector>

#include "schema/formats/navspace.h"

namespace vantage {

/// The edges of a navigation space that correspondences are found for: all but those between cameras that have another
/// camera in between. Such edges close dents of the hull where cameras start late or end early; the maps to the camera
/// in between tell more.
class MatchedEdges {
 public:
  using Edge = std::pair<int, int>;  ///< vertices, first < second

  explicit MatchedEdges(const Navspace& navspace);
  const std::vector<Edge>& all() const { return edges_; }
  /// Those between the given vertices (rising), in the order of their first ones.
  std::vector<Edge> among(const std::vector<int>& vertices) const;

 private:
  std::vector<Edge> edges_;
  std::vector<std::vector<int>> later_;  ///< by vertex: the second ones of its edges
};

}  // namespace vantage
