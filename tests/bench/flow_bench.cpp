/// How well and at what cost free_flow finds motion. Folders in the layout of the Middlebury flow benchmark
/// (frame10.png, frame11.png, flow10.flo; frame10i11.png for the frame in the middle), or pairs of its own: small
/// motion, things that jump, and a pair of 1920 x 1080 like two frames of the target footage.
#include <fmt/format.h>
#include <sys/resource.h>

#include <ctime>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <string>

#include "jobs/correspond/free_flow.h"
#include "tests/bench/middle_frame.h"
#include "tests/jobs/correspond/moving_layers.h"

namespace vantage {
namespace {

constexpr float kUnknown_px = 1e9F;  ///< of the .flo format

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

long peak_mib() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss / 1024;
}

struct Errors {
  double mean_px = 0, over_1px_percent = 0, over_3px_percent = 0;
  int num = 0;
};

/// Over pixels with a known motion, and within `of` unless that is empty.
Errors errors(const cv::Mat2f& motion, const cv::Mat2f& truth, const cv::Mat1b& of) {
  Errors e;
  for (int y = 0; y < truth.rows; ++y)
    for (int x = 0; x < truth.cols; ++x) {
      const cv::Vec2f t = truth(y, x);
      if (!(std::abs(t[0]) < kUnknown_px && std::abs(t[1]) < kUnknown_px) || (!of.empty() && of(y, x) == 0)) continue;
      const double length = cv::norm(motion(y, x) - t);
      e.mean_px += length, e.over_1px_percent += length > 1, e.over_3px_percent += length > 3, ++e.num;
    }
  const double num = std::max(1, e.num);
  return {e.mean_px / num, 100 * e.over_1px_percent / num, 100 * e.over_3px_percent / num, e.num};
}

std::string error_fields(const Errors& all) {
  return fmt::format(R"("aepe_px": {:.4f}, "over_1px_percent": {:.2f}, "over_3px_percent": {:.2f}, )", all.mean_px,
                     all.over_1px_percent, all.over_3px_percent);
}

struct Timed {
  FlowPair flow;
  double cpu_s;
};
Timed timed_flow(const cv::Mat1b& a, const cv::Mat1b& b) {
  const double start_s = cpu_s();
  FlowPair flow = free_flow(a, b, {});
  return {std::move(flow), cpu_s() - start_s};
}

void print(const std::string& name, cv::Size size, const std::string& figures, double spent_s) {
  fmt::print(R"({{"bench": "flow", "pair": "{}", "width": {}, "height": {}, {}"cpu_s_both_ways": {:.2f}, )"
             R"("peak_mib": {}}})"
             "\n",
             name, size.width, size.height, figures, spent_s, peak_mib());
}

void bench_folder(const std::filesystem::path& folder) {
  const cv::Mat a = cv::imread((folder / "frame10.png").string()), b = cv::imread((folder / "frame11.png").string());
  if (a.empty() || b.empty() || a.size() != b.size()) {
    fmt::print(stderr, "flow_bench: {}: expected frame10.png and frame11.png of one size\n", folder.string());
    std::exit(1);
  }
  cv::Mat1b grey_a, grey_b;
  cv::cvtColor(a, grey_a, cv::COLOR_BGR2GRAY);
  cv::cvtColor(b, grey_b, cv::COLOR_BGR2GRAY);
  const Timed timed = timed_flow(grey_a, grey_b);
  std::string figures;
  if (const auto path = folder / "flow10.flo"; std::filesystem::exists(path))
    figures += error_fields(errors(timed.flow.a_to_b, cv::readOpticalFlow(path.string()), {}));
  if (const cv::Mat middle = cv::imread((folder / "frame10i11.png").string()); !middle.empty())
    figures += fmt::format(R"("middle_frame_psnr_db": {:.2f}, )", psnr_db(middle_frame(a, b, timed.flow), middle));
  print(folder.filename().string(), a.size(), figures, timed.cpu_s);
}

void bench_layers(const std::string& name, cv::Size size, const std::vector<synthetic::Layer>& layers) {
  const synthetic::LayeredPair pair = synthetic::render_layers(size, layers, 2);
  const Timed timed = timed_flow(pair.a, pair.b);
  const Errors seen = errors(timed.flow.a_to_b, pair.a_to_b, pair.visible);
  print(name, size,
        error_fields(errors(timed.flow.a_to_b, pair.a_to_b, {})) +
            fmt::format(R"("aepe_seen_twice_px": {:.4f}, )", seen.mean_px),
        timed.cpu_s);
}

/// Discs of many sizes over a background; the longest motion is `reach_px`.
std::vector<synthetic::Layer> discs(cv::Size size, double reach_px) {
  std::vector<synthetic::Layer> layers{
      {{size.width / 2.0, size.height / 2.0}, 0, {0.06 * reach_px + 0.3, -0.2}, 0.004}};
  for (int k = 0; k < 6; ++k) {
    const double share = (k + 1) / 6.0, angle = 2.4 * k;
    layers.push_back({{size.width * (0.2 + 0.12 * k), size.height * (0.3 + 0.4 * (k % 2))},
                      size.height * (0.16 - 0.015 * k),
                      {reach_px * share * std::cos(angle), 0.5 * reach_px * share * std::sin(angle)},
                      0.1 * std::sin(5.0 * k)});
  }
  return layers;
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  using namespace vantage;
  for (int k = 1; k < argc; ++k) bench_folder(argv[k]);
  if (argc > 1) return 0;
  bench_layers("small motion", {640, 480}, discs({640, 480}, 6));
  bench_layers("jumps", {640, 480}, discs({640, 480}, 120));
  bench_layers("1080p", {1920, 1080}, discs({1920, 1080}, 40));
}
