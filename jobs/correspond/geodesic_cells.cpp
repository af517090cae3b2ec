#include "jobs/correspond/geodesic_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace vantage {
namespace {

constexpr float kFar = 1e30F;

std::vector<cv::Point> flat_centres(const cv::Mat1f& slope, int spacing_px) {
  std::vector<cv::Point> centres;
  const int reach = std::max(1, spacing_px / 4);
  const cv::Rect whole({}, slope.size());
  for (int y = spacing_px / 2; y < slope.rows + spacing_px / 2; y += spacing_px)
    for (int x = spacing_px / 2; x < slope.cols + spacing_px / 2; x += spacing_px) {
      const cv::Point middle(std::min(x, slope.cols - 1), std::min(y, slope.rows - 1));
      const cv::Rect near = cv::Rect(middle - cv::Point(reach, reach), cv::Size(2 * reach + 1, 2 * reach + 1)) & whole;
      cv::Point flattest;
      cv::minMaxLoc(slope(near), nullptr, nullptr, &flattest);
      centres.push_back(flattest + near.tl());
    }
  return centres;
}

/// One pass of the distance transform over rows, downwards or upwards (Toivanen 1996).
void sweep(const cv::Mat1f& slope, int step, cv::Mat1f& distance, cv::Mat1i& cell) {
  const std::array<cv::Point, 4> before{cv::Point(-step, 0), {-step, -step}, {0, -step}, {step, -step}};
  const std::array<float, 4> length{1, 1.41421356F, 1, 1.41421356F};
  const int num = slope.rows * slope.cols;
  for (int k = 0; k < num; ++k) {
    const int at = step > 0 ? k : num - 1 - k, y = at / slope.cols, x = at % slope.cols;
    for (std::size_t n = 0; n < 4; ++n) {
      const int px = x + before[n].x, py = y + before[n].y;
      if (px < 0 || py < 0 || px >= slope.cols || py >= slope.rows) continue;
      const float way = distance(py, px) + length[n] * 0.5F * (slope(y, x) + slope(py, px));
      if (way >= distance(y, x)) continue;
      distance(y, x) = way;
      cell(y, x) = cell(py, px);
    }
  }
}

void join(GeodesicCells& cells, int from, int to, float length) {
  auto& list = cells.borders[static_cast<std::size_t>(from)];
  const auto found = std::find_if(list.begin(), list.end(), [&](const auto& b) { return b.to == to; });
  if (found == list.end())
    list.push_back({to, length});
  else
    found->length = std::min(found->length, length);
}

}  // namespace

GeodesicCells geodesic_cells(const cv::Mat1f& grey, int spacing_px, float edge_contrast) {
  cv::Mat1f dx, dy, slope;
  cv::Sobel(grey, dx, CV_32F, 1, 0, 3, 1.0 / 8, 0, cv::BORDER_REPLICATE);
  cv::Sobel(grey, dy, CV_32F, 0, 1, 3, 1.0 / 8, 0, cv::BORDER_REPLICATE);
  cv::magnitude(dx, dy, slope);
  slope = 1 + slope / edge_contrast;
  GeodesicCells cells{flat_centres(slope, spacing_px), cv::Mat1i(grey.size(), -1), {}};
  cells.borders.resize(cells.centres.size());
  cv::Mat1f distance(grey.size(), kFar);
  for (std::size_t k = 0; k < cells.centres.size(); ++k) {
    distance(cells.centres[k]) = 0;
    cells.cell(cells.centres[k]) = static_cast<int>(k);
  }
  for (int round = 0; round < 2; ++round) sweep(slope, 1, distance, cells.cell), sweep(slope, -1, distance, cells.cell);
  for (int y = 0; y < grey.rows; ++y)
    for (int x = 0; x < grey.cols; ++x)
      for (const cv::Point next : {cv::Point(x + 1, y), cv::Point(x, y + 1)}) {
        if (next.x >= grey.cols || next.y >= grey.rows || cells.cell(next) == cells.cell(y, x)) continue;
        const float length = distance(y, x) + distance(next) + 0.5F * (slope(y, x) + slope(next));
        join(cells, cells.cell(y, x), cells.cell(next), length);
        join(cells, cells.cell(next), cells.cell(y, x), length);
      }
  return cells;
}

CellWalk::CellWalk(const GeodesicCells& cells) : cells_(cells), best_(cells.centres.size(), kFar) {}

void CellWalk::reset() {
  for (const int cell : touched_) best_[static_cast<std::size_t>(cell)] = kFar;
  touched_.clear();
  heap_.clear();
  visited_.clear();
}

bool CellWalk::next(CellDistance& out) {
  const auto farther = [](const CellDistance& a, const CellDistance& b) {
    return a.distance != b.distance ? a.distance > b.distance : a.cell > b.cell;
  };
  while (!heap_.empty()) {
    std::pop_heap(heap_.begin(), heap_.end(), farther);
    out = heap_.back();
    heap_.pop_back();
    if (out.distance > best_[static_cast<std::size_t>(out.cell)]) continue;
    for (const auto& border : cells_.borders[static_cast<std::size_t>(out.cell)]) {
      const float way = out.distance + border.length;
      float& best = best_[static_cast<std::size_t>(border.to)];
      if (way >= best) continue;
      if (best == kFar) touched_.push_back(border.to);
      best = way;
      heap_.push_back({border.to, way});
      std::push_heap(heap_.begin(), heap_.end(), farther);
    }
    return true;
  }
  return false;
}

}  // namespace vantage
