/// A path through the navigation space is a film: no frame jumps where cells, images or frames change.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "jobs/navspace/build_navspace.h"
#include "jobs/render/render_view.h"
#include "jobs/views/sphere.h"
#include "jobs/vision/colour_space.h"
#include "tests/support/synthetic_scene.h"

namespace vantage {
namespace {

constexpr int kWidth = 160, kHeight = 90, kNumFrames = 4, kNumSteps = 200;

/// Five cameras on a sphere, in two rows, unsynchronised; depth that is wrong by up to 1 % in every image, in its own
/// way, as estimated depth is.
class CamerasOnASphere {
 public:
  CamerasOnASphere() {
    navspace.centre = scene_.centre();
    navspace.axes << 1, 0, 0, 0, -1, 0, 0, 0, -1;
    navspace.radius = 4;
    const double directions[][3] = {{-8, 12, 0}, {-7, 19, 0.013}, {1, 11, 0.021}, {0, 20, 0.006}, {8, 14, 0.029}};
    for (const auto& [azimuth_deg, elevation_deg, offset_s] : directions)
      add_camera(azimuth_deg, elevation_deg, offset_s);
    join_vertices(navspace, {});
  }

  std::vector<VirtualView> views(const std::vector<KeyFrame>& path) const {
    RenderRequest request;
    request.fps = kNumSteps - 1;
    request.keyframes = path;
    return virtual_views(request, shot_, calibration_, navspace);
  }

  cv::Mat3f draw(const VirtualView& view) {
    RenderRequest request;
    FramePlan plan = plan_frame(view, view, request, calibration_, navspace, MatchedEdges(navspace));
    plan.method = "depth";
    std::vector<SourceImage> images;
    for (const PlannedImage& planned : plan.images) images.push_back(image(planned.id));
    for (const auto& [a, b] : plan.edges) {
      const auto i = static_cast<std::size_t>(a), k = static_cast<std::size_t>(b);
      if (images[i].id.camera != images[k].id.camera) continue;
      images[i].flows[b] = motion(images[i], images[k]);
      images[k].flows[a] = motion(images[k], images[i]);
    }
    return render_eye(images, plan, plan.eyes.front()).bgr;
  }

  cv::Mat3f recorded(const ImageId& id) { return image(id).bgr; }

  Navspace navspace;

 private:
  void add_camera(double azimuth_deg, double elevation_deg, double offset_s) {
    const std::string name = "cam" + std::to_string(shot_.cameras.size());
    ShotCamera camera;
    camera.name = name;
    shot_.cameras.push_back(camera);
    calibration_.cameras[name] = {
        name, static_cast<int>(shot_.cameras.size()), {kWidth, kHeight, 150, 150, kWidth / 2.0, kHeight / 2.0}, {}};
    const Eigen::Vector3d eye = world_point(navspace, {azimuth_deg, elevation_deg, 4});
    for (int k = 0; k < kNumFrames; ++k) {
      calibration_.cam_from_world[{name, k}] = look_at(eye, navspace.centre, {0, -1, 0});
      navspace.vertices.push_back({{name, k}, azimuth_deg, elevation_deg, offset_s + k / 25.0});
      times_s_[{name, k}] = offset_s + k / 25.0;
    }
  }

  const SourceImage& image(const ImageId& id) {
    const auto found = images_.find(id);
    if (found != images_.end()) return found->second;
    const Pinhole& pinhole = calibration_.camera(id.camera).pinhole;
    const synthetic::Picture& p = pictures_[id] = scene_.render(pinhole, calibration_.pose(id), times_s_.at(id));
    SourceImage image{
        id, times_s_.at(id), pinhole, calibration_.pose(id), linear_from_srgb(p.bgr), {p.depth.clone(), {}}, {}};
    const double phase = static_cast<double>(images_.size());
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        image.depth.z(y, x) *=
            static_cast<float>(1 + 0.01 * std::sin(0.05 * x + phase) * std::cos(0.07 * y + 2 * phase));
    image.depth.confidence = cv::Mat1f(p.depth.size(), 1.0F);
    return images_[id] = image;
  }

  FlowMap motion(const SourceImage& from, const SourceImage& to) {
    const synthetic::Truth truth = scene_.correspondence(pictures_.at(from.id), from.pinhole, from.cam_from_world,
                                                         from.time_s, to.pinhole, to.cam_from_world, to.time_s);
    FlowMap flow{truth.motion_px, {}};
    truth.visible.convertTo(flow.confidence, CV_32F, 1 / 255.0);
    return flow;
  }

  synthetic::Scene scene_;
  Calibration calibration_;
  Shot shot_;
  std::map<ImageId, double> times_s_;
  std::map<ImageId, synthetic::Picture> pictures_;
  std::map<ImageId, SourceImage> images_;
};

double rms(const cv::Mat3f& a, const cv::Mat3f& b) {
  return cv::norm(srgb8_from_linear(a), srgb8_from_linear(b), cv::NORM_L2) / std::sqrt(3.0 * kWidth * kHeight);
}

TEST(Continuity, NoFrameOfAPathThroughFiveTetrahedraJumps) {
  CamerasOnASphere cameras;
  std::set<std::vector<int>> cells;
  std::vector<double> changes;
  cv::Mat3f before;
  for (const VirtualView& view : cameras.views({{0, 0.05, -5, 13.5}, {1, 0.10, 5, 15.5}})) {
    cells.insert(view.location.vertices);
    EXPECT_FALSE(view.location.outside);
    const cv::Mat3f now = cameras.draw(view);
    if (!before.empty()) changes.push_back(rms(before, now));
    before = now;
  }
  ASSERT_EQ(changes.size(), kNumSteps - 1U);
  EXPECT_GE(cells.size(), 5U);
  std::vector<double> sorted = changes;
  std::sort(sorted.begin(), sorted.end());
  const double median = sorted[sorted.size() / 2];
  const auto worst = std::max_element(changes.begin(), changes.end());
  RecordProperty("median_levels", std::to_string(median));
  RecordProperty("worst_levels", std::to_string(*worst));
  EXPECT_LE(*worst, 1.5 * median) << "step " << worst - changes.begin();
}

TEST(Continuity, AtEveryRecordedImageTheViewIsThatImage) {
  CamerasOnASphere cameras;
  for (const NavVertex& v : cameras.navspace.vertices) {
    if (v.image.frame != 1) continue;
    const cv::Mat3f drawn = cameras.draw(cameras.views({{0, v.time_s, v.azimuth_deg, v.elevation_deg}}).front());
    EXPECT_GE(cv::PSNR(srgb8_from_linear(drawn), srgb8_from_linear(cameras.recorded(v.image))), 50) << v.image.label();
  }
}

}  // namespace
}  // namespace vantage
