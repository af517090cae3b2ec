#include "jobs/calibrate/preview.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "jobs/calibrate/gauge.h"

namespace vantage {
namespace {

const cv::Size kSize(480, 360);

/// From above: to the right and ahead, in the world's unit.
using Ground = Eigen::Vector2d;

struct Map {
  Ground low, high;
  cv::Point2d operator()(const Ground& p) const {
    const double scale = 0.88 * std::min(kSize.width / (high - low).x(), kSize.height / (high - low).y());
    const Ground centred = scale * (p - (low + high) / 2);
    return {kSize.width / 2.0 + centred.x(), kSize.height / 2.0 - centred.y()};
  }
};

/// Room for all cameras and nine tenths of the points in each direction: strays would shrink everything.
Map map_around(const std::vector<Ground>& cameras, const std::vector<Ground>& points) {
  Map map{cameras[0], cameras[0]};
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> values;
    for (const auto& p : points) values.push_back(p[axis]);
    std::sort(values.begin(), values.end());
    if (!values.empty()) {
      map.low[axis] = std::min(map.low[axis], values[values.size() / 20]);
      map.high[axis] = std::max(map.high[axis], values[values.size() - 1 - values.size() / 20]);
    }
    for (const auto& c : cameras)
      map.low[axis] = std::min(map.low[axis], c[axis]), map.high[axis] = std::max(map.high[axis], c[axis]);
    if (map.high[axis] - map.low[axis] < 1e-9) map.high[axis] = map.low[axis] + 1;
  }
  return map;
}

void draw_camera(cv::Mat& picture, const Map& map, const Ground& centre, const Ground& ahead, const std::string& name) {
  const cv::Point2d at = map(centre);
  cv::Point2d towards = map(centre + ahead) - at;
  towards *= 18 / std::max(1e-9, cv::norm(towards));
  const cv::Point2d side(-towards.y * 0.5, towards.x * 0.5);
  const std::vector<cv::Point> cone{at, at + towards + side, at + towards - side};
  cv::polylines(picture, std::vector<std::vector<cv::Point>>{cone}, true, {40, 90, 230}, 1, cv::LINE_AA);
  cv::putText(picture, name, at + cv::Point2d(5, 14), cv::FONT_HERSHEY_SIMPLEX, 0.36, {60, 60, 60}, 1, cv::LINE_AA);
}

}  // namespace

cv::Mat top_view(const Calibration& calibration) {
  const Eigen::Matrix3d axes = viewing_axes(calibration);
  const auto ground = [&](const Eigen::Vector3d& v) { return Ground(axes.row(0).dot(v), axes.row(2).dot(v)); };
  std::vector<Ground> cameras, points;
  for (const auto& [image, pose] : calibration.cam_from_world) cameras.push_back(ground(pose.centre()));
  for (const auto& p : calibration.points) points.push_back(ground(p.position));
  const Map map = map_around(cameras, points);
  cv::Mat picture(kSize, CV_8UC3, cv::Scalar::all(250));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& rgb = calibration.points[i].rgb;
    cv::circle(picture, map(points[i]), 1, cv::Scalar(rgb.z(), rgb.y(), rgb.x()), cv::FILLED);
  }
  std::string named;
  for (const auto& [image, pose] : calibration.cam_from_world) {
    if (image.camera == named) continue;
    named = image.camera;
    draw_camera(picture, map, ground(pose.centre()), ground(pose.R.row(2).transpose()), image.camera);
  }
  return picture;
}

}  // namespace vantage
