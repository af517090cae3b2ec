/// A view from four images (two cameras, two frames each) of a textured scene with exact depth and motion, as in a
/// 1080p shot on an arc: CPU seconds per stage and the error against the true view. One JSON line.
/// render_bench [width height repeats]
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <opencv2/core.hpp>

#include "jobs/render/fill_holes.h"
#include "jobs/render/render_view.h"
#include "jobs/vision/colour_space.h"
#include "tests/support/synthetic_scene.h"

namespace vantage {
namespace {

struct Case {
  std::vector<SourceImage> images;
  FramePlan plan;
  PlannedEye eye;
  cv::Mat3b truth;
};

SourceImage image_of(const synthetic::Scene& scene, const synthetic::SceneCamera& camera, int frame) {
  const synthetic::Picture p = scene.render(camera.pinhole, camera.pose(frame), camera.time_s(frame));
  SourceImage image;
  image.id = {camera.name, frame};
  image.time_s = camera.time_s(frame);
  image.pinhole = camera.pinhole;
  image.cam_from_world = camera.pose(frame);
  image.bgr = linear_from_srgb(p.bgr);
  image.depth = {p.depth, cv::Mat1f(p.depth.size(), 1.0F)};
  const synthetic::Truth motion =
      scene.correspondence(p, camera.pinhole, camera.pose(frame), camera.time_s(frame), camera.pinhole,
                           camera.pose(1 - frame), camera.time_s(1 - frame));
  cv::Mat1f seen;
  motion.visible.convertTo(seen, CV_32F, 1 / 255.0);
  image.flows[0] = {motion.motion_px, seen};
  return image;
}

Case make_case(int width, int height) {
  const synthetic::Scene scene({.supersample = 1});
  Case c;
  for (const auto& camera : synthetic::arc_cameras(2, 2, width, height, 8, 0))
    for (int frame = 0; frame < 2; ++frame) {
      c.images.push_back(image_of(scene, camera, frame));
      const int other = static_cast<int>(c.images.size() - 1) ^ 1;
      auto flow = c.images.back().flows.extract(0);
      flow.key() = other;
      c.images.back().flows.insert(std::move(flow));
      c.plan.images.push_back({c.images.back().id, c.images.back().time_s});
    }
  c.eye.mu = c.eye.share = {0.3, 0.25, 0.25, 0.2};
  c.eye.pinhole = c.images[0].pinhole;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    centre += c.eye.mu[k] * c.images[k].cam_from_world.centre();
    c.plan.time_s += c.eye.mu[k] * c.images[k].time_s;
  }
  c.eye.cam_from_world = {c.images[0].cam_from_world.R, -c.images[0].cam_from_world.R * centre};
  c.plan.method = "depth";
  c.truth = scene.render(c.eye.pinhole, c.eye.cam_from_world, c.plan.time_s).bgr;
  return c;
}

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }
double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// CPU seconds of `what`, median of `repeats`.
template <class What>
double timed(int repeats, const What& what) {
  std::vector<double> seconds;
  for (int k = 0; k < repeats; ++k) {
    const double start = cpu_s();
    what();
    seconds.push_back(cpu_s() - start);
  }
  return median(std::move(seconds));
}

Json stages(const Case& c, int repeats) {
  const ViewCamera view{c.eye.pinhole, c.eye.cam_from_world, {}};
  const PlacingOptions placing{c.plan.method, c.plan.time_s, c.plan.scene_distance, c.eye.mu};
  const PixelPlaces places(c.images, 0, view, placing);
  PlacedRow row(places.size().width);
  std::vector<PictureLayer> layers(c.images.size());
  const auto place = [&] {
    for (int y = 0; y < places.size().height; ++y) places.row(y, row);
  };
  const auto splat_all = [&] {
    for (std::size_t k = 0; k < c.images.size(); ++k)
      layers[k] = {splat(PixelPlaces(c.images, static_cast<int>(k), view, placing),
                         {view.pinhole.width, view.pinhole.height}, 1),
                   c.images[k].bgr, static_cast<float>(c.eye.share[k])};
  };
  ViewPicture picture;
  Json j;
  j["place_cpu_s"] = 4 * timed(repeats, place);
  j["place_and_splat_cpu_s"] = timed(repeats, splat_all);
  j["blend_cpu_s"] = timed(repeats, [&] { picture = blend(layers); });
  j["fill_cpu_s"] = timed(repeats, [&] { fill_holes(picture); });
  return j;
}

int run(int width, int height, int repeats) {
  const Case c = make_case(width, height);
  Json j = {{"bench", "render"}, {"imitates", "view between two cameras and two frames of an arc"},
            {"width", width},    {"height", height},
            {"images", 4},       {"repeats", repeats}};
  cv::setNumThreads(1);
  j.update(stages(c, repeats));
  ViewPicture picture;
  j["view_cpu_s"] = timed(repeats, [&] { picture = render_eye(c.images, c.plan, c.eye); });
  cv::setNumThreads(2);
  std::vector<double> wall;
  for (int k = 0; k < repeats; ++k) {
    const auto start = std::chrono::steady_clock::now();
    picture = render_eye(c.images, c.plan, c.eye);
    wall.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  j["view_wall_2_threads_s"] = median(wall);
  j["psnr_db"] = cv::PSNR(srgb8_from_linear(picture.bgr), c.truth);
  j["holes_percent"] = 100 * (1 - cv::mean(picture.alpha)[0]);
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  j["peak_rss_mb"] = usage.ru_maxrss / 1024;
  fmt::print("{}\n", j.dump());
  return 0;
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  const auto number = [&](int k, int otherwise) { return argc > k ? std::stoi(argv[k]) : otherwise; };
  return vantage::run(number(1, 1920), number(2, 1080), number(3, 5));
}
