#include "jobs/correspond/free_flow.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "jobs/correspond/coarse_to_fine_flow.h"
#include "jobs/correspond/fill_hidden.h"
#include "jobs/correspond/fuse_flow.h"
#include "jobs/correspond/interpolate_matches.h"
#include "jobs/correspond/patch_match.h"
#include "jobs/correspond/variational_flow.h"

namespace vantage {
namespace {

/// Takes the finest noise away without a corner's position.
constexpr double kPrefilter_px = 0.6;

cv::Mat1f prefiltered(const cv::Mat1b& grey) {
  cv::Mat1f out;
  grey.convertTo(out, CV_32F);
  cv::GaussianBlur(out, out, {}, kPrefilter_px);
  return out;
}

cv::Mat1b shrunk(const cv::Mat1b& grey, int max_pixels) {
  const double scale = std::sqrt(static_cast<double>(max_pixels) / static_cast<double>(grey.total()));
  if (scale >= 1) return grey;
  cv::Mat1b small;
  cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
  return small;
}

cv::Mat2f jumped(const cv::Mat1f& from, const cv::Mat1f& to, const std::vector<SparseMatch>& matches) {
  cv::Mat2f motion = interpolate_matches(from, matches, {});
  refine_variational(from, to, {}, motion, {.warps = 2});
  return motion;
}

FlowPair search(const cv::Mat1b& a8, const cv::Mat1b& b8, const FreeFlowOptions& options) {
  const cv::Mat1f a = prefiltered(a8), b = prefiltered(b8);
  FlowPair flow{coarse_to_fine_flow(a, b, {.warps = 2}), coarse_to_fine_flow(b, a, {.warps = 2})};
  if (options.jumps) {
    const SparseMatches matches = patch_matches(a, b, {});
    flow = fuse_flows(a8, b8, flow, {jumped(a, b, matches.a_to_b), jumped(b, a, matches.b_to_a)}, {});
  }
  fill_hidden(a, b, flow);
  return flow;
}

cv::Mat1b extended(const cv::Mat1b& picture, cv::Size size) {
  cv::Mat1b out;
  cv::copyMakeBorder(picture, out, 0, size.height - picture.rows, 0, size.width - picture.cols, cv::BORDER_REPLICATE);
  return out;
}

/// Both on canvases that hold either.
FlowPair flow_of_two_sizes(const cv::Mat1b& a, const cv::Mat1b& b, const FreeFlowOptions& options) {
  const cv::Size both(std::max(a.cols, b.cols), std::max(a.rows, b.rows));
  const FlowPair flow = free_flow(extended(a, both), extended(b, both), options);
  return {flow.a_to_b(cv::Rect({}, a.size())).clone(), flow.b_to_a(cv::Rect({}, b.size())).clone()};
}

}  // namespace

FlowPair free_flow(const cv::Mat1b& a, const cv::Mat1b& b, const FreeFlowOptions& options) {
  if (a.size() != b.size()) return flow_of_two_sizes(a, b, options);
  FlowPair flow = search(shrunk(a, options.max_search_pixels), shrunk(b, options.max_search_pixels), options);
  const cv::Mat1f full_a = prefiltered(a), full_b = prefiltered(b);
  flow = {resized_motion(flow.a_to_b, a.size()), resized_motion(flow.b_to_a, b.size())};
  const cv::Mat1f trust_a = comes_back(flow.a_to_b, flow.b_to_a), trust_b = comes_back(flow.b_to_a, flow.a_to_b);
  refine_variational(full_a, full_b, trust_a, flow.a_to_b, {.warps = 2});
  refine_variational(full_b, full_a, trust_b, flow.b_to_a, {.warps = 2});
  return flow;
}

}  // namespace vantage
