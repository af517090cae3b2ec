#pragma once
#include <opencv2/core.hpp>
#include <vector>

namespace vantage {

/// A picture cut along its edges into cells of about equal size: each pixel belongs to the centre that it can be
/// reached from by the shortest path, where crossing an edge is a long step.
struct GeodesicCells {
  struct Border {
    int to;
    float length;  ///< shortest way from centre to centre
  };
  std::vector<cv::Point> centres;
  cv::Mat1i cell;                            ///< of each pixel
  std::vector<std::vector<Border>> borders;  ///< of each cell with its neighbours, by number
};

/// spacing_px: between centres before each moves to the flattest pixel nearby. edge_contrast: grey levels per px that
/// make a step twice as long.
GeodesicCells geodesic_cells(const cv::Mat1f& grey, int spacing_px, float edge_contrast);

/// Cells in the order of their distance from one, with distances, until `enough(cell)` says so; the first is itself.
struct CellDistance {
  int cell;
  float distance;
};
class CellWalk {
 public:
  explicit CellWalk(const GeodesicCells& cells);
  template <class Enough>
  const std::vector<CellDistance>& from(int start, Enough&& enough);

 private:
  void reset();
  bool next(CellDistance& out);
  const GeodesicCells& cells_;
  std::vector<float> best_;
  std::vector<CellDistance> heap_, visited_;
  std::vector<int> touched_;
};

template <class Enough>
const std::vector<CellDistance>& CellWalk::from(int start, Enough&& enough) {
  reset();
  best_[static_cast<std::size_t>(start)] = 0;
  touched_.push_back(start);
  heap_.push_back({start, 0});
  for (CellDistance cell{}; next(cell);) {
    visited_.push_back(cell);
    if (enough(cell.cell)) break;
  }
  return visited_;
}

}  // namespace vantage
