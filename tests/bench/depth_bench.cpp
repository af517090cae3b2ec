// A depth map of one picture from four edges (two cameras, two frames each) and the frames before and after it, on the
// synthetic scene: what a depth job and its "single" do, without reading and writing. Matches are true ones with noise
// of 0.2 px, and those of a pixel-wide rim at outlines belong to the other side, as real ones do.
// depth_bench [WIDTH HEIGHT]: one JSON line.
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "jobs/depth/fuse_depth.h"
#include "jobs/depth/regularise.h"
#include "jobs/depth/steady_depth.h"
#include "jobs/depth/triangulate_edge.h"
#include "tests/support/synthetic_scene.h"

namespace {

using namespace vantage;
using synthetic::Picture;
using synthetic::SceneCamera;

constexpr double kTime_s = 0.3, kFrame_s = 1.0 / 30, kNoise_px = 0.2, kAgreement = 0.015;

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

class Bench {
 public:
  Bench(int width, int height) : cameras_(synthetic::arc_cameras(3, 1, width, height)), image_(expose(1, kTime_s)) {}

  void run() {
    std::vector<EdgeDepth> edges;
    double triangulate_s = 0;
    for (const std::size_t k : {0U, 2U})
      for (const double lag_s : {0.3 * kFrame_s, -0.7 * kFrame_s}) {
        const FlowMap to_other = matches(1, image_, kTime_s, k, kTime_s - lag_s);
        const double step_s = lag_s > 0 ? kFrame_s : -kFrame_s;
        const StepFlow step{matches(k, expose(k, kTime_s - lag_s), kTime_s - lag_s, k, kTime_s - lag_s + step_s),
                            step_s};
        const double start = cpu_s();
        edges.push_back(
            triangulate_edge(TwoView(at(1).pinhole, at(1).cam_from_world, at(k).pinhole, at(k).cam_from_world),
                             at(k).pinhole.fx, to_other, lag_s, step, {}));
        triangulate_s += cpu_s() - start;
      }
    double start = cpu_s();
    const DepthMap own = fuse_depths(edges, kAgreement);
    const double fuse_s = cpu_s() - start;
    std::vector<DepthFrame> around;
    for (const double step_s : {-kFrame_s, kFrame_s})
      around.push_back({own, at(1).cam_from_world, matches(1, image_, kTime_s, 1, kTime_s + step_s)});
    start = cpu_s();
    std::vector<DepthMap> carried;
    for (const DepthFrame& frame : around) carried.push_back(carried_depth(frame, at(1).pinhole, at(1).cam_from_world));
    const DepthMap steady = steady_depth(own, carried, kAgreement / 3);
    const double steady_s = cpu_s() - start;
    start = cpu_s();
    const DepthMap depth = regularise(steady, image_.bgr, {});
    print(depth, {triangulate_s, fuse_s, steady_s, cpu_s() - start});
  }

 private:
  struct Cost {
    double triangulate_s, fuse_s, steady_s, regularise_s;
  };
  const SceneCamera& at(std::size_t k) const { return cameras_[k]; }
  Picture expose(std::size_t k, double time_s) const {
    return scene_.render(at(k).pinhole, at(k).cam_from_world, time_s);
  }
  FlowMap matches(std::size_t from, const Picture& picture, double from_s, std::size_t to, double to_s) {
    const synthetic::Truth truth = scene_.correspondence(picture, at(from).pinhole, at(from).cam_from_world, from_s,
                                                         at(to).pinhole, at(to).cam_from_world, to_s);
    FlowMap flow{truth.motion_px.clone(), cv::Mat1f(truth.visible.size(), 0.0F)};
    flow.confidence.setTo(1.0F, truth.visible);
    cv::Mat2f noise(flow.motion_px.size());
    random_.fill(noise, cv::RNG::NORMAL, 0, kNoise_px);
    for (int y = 0; y < noise.rows; ++y)
      for (int x = 1; x < noise.cols; ++x)
        flow.motion_px(y, x) = truth.motion_px(y, picture.id(y, x) != picture.id(y, x - 1) ? x - 1 : x) + noise(y, x);
    return flow;
  }
  void print(const DepthMap& depth, const Cost& cost) const {
    std::vector<double> errors;
    int surface = 0;
    for (int y = 0; y < depth.z.rows; ++y)
      for (int x = 0; x < depth.z.cols; ++x) {
        surface += image_.depth(y, x) > 0;
        if (depth.z(y, x) > 0 && image_.depth(y, x) > 0)
          errors.push_back(std::abs(depth.z(y, x) / image_.depth(y, x) - 1));
      }
    std::sort(errors.begin(), errors.end());
    const auto within = std::lower_bound(errors.begin(), errors.end(), 0.01) - errors.begin();
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    fmt::print(
        "{{\"bench\": \"depth\", \"width\": {}, \"height\": {}, \"num_edges\": 4, \"error_median_percent\": {:.4f}, "
        "\"within_1_percent_percent\": {:.2f}, \"coverage_percent\": {:.2f}, \"triangulate_cpu_s\": {:.3f}, "
        "\"fuse_cpu_s\": {:.3f}, \"steady_cpu_s\": {:.3f}, \"regularise_cpu_s\": {:.3f}, \"cpu_s\": {:.3f}, "
        "\"peak_mb\": {}}}\n",
        depth.z.cols, depth.z.rows, errors.empty() ? -1 : 100 * errors[errors.size() / 2],
        100.0 * static_cast<double>(within) / static_cast<double>(std::max<std::size_t>(1, errors.size())),
        100.0 * static_cast<double>(errors.size()) / std::max(1, surface), cost.triangulate_s, cost.fuse_s,
        cost.steady_s, cost.regularise_s, cost.triangulate_s + cost.fuse_s + cost.steady_s + cost.regularise_s,
        usage.ru_maxrss / 1024);
  }

  synthetic::Scene scene_;
  std::vector<SceneCamera> cameras_;
  cv::RNG random_{7};
  Picture image_;
};

}  // namespace

int main(int argc, char** argv) {
  const int width = argc > 2 ? std::atoi(argv[1]) : 1920, height = argc > 2 ? std::atoi(argv[2]) : 1080;
  if (width < 64 || height < 64) {
    fmt::print(stderr, "usage: depth_bench [WIDTH HEIGHT], each 64 or more\n");
    return 2;
  }
  cv::setNumThreads(1);
  Bench(width, height).run();
  return 0;
}
