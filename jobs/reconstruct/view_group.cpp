#include "jobs/reconstruct/view_group.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "schema/base/error.h"

namespace vantage {
namespace {

/// Pinhole of an image that was resized to size. Coordinates have pixel centres at +0.5, so they scale without offset.
Pinhole resized(const Pinhole& full, cv::Size size) {
  const double sx = static_cast<double>(size.width) / full.width, sy = static_cast<double>(size.height) / full.height;
  return {size.width, size.height, full.fx * sx, full.fy * sy, full.cx * sx, full.cy * sy};
}

int level_for(const std::vector<GroupImage>& images, int level) {
  if (level >= 0) return level;
  int widest = 0;
  for (const auto& image : images) widest = std::max(widest, image.bgr.cols);
  int halvings = 0;
  while ((widest >> halvings) > kAutoWidthPx) ++halvings;
  return halvings;
}

View make_view(const GroupImage& image, int level) {
  View view;
  view.id = image.id;
  view.cam_from_world = image.cam_from_world;
  view.centre = image.cam_from_world.centre();
  const cv::Size size(std::max(1, image.bgr.cols >> level), std::max(1, image.bgr.rows >> level));
  cv::resize(image.bgr, view.bgr, size, 0, 0, cv::INTER_AREA);
  view.pinhole = resized(image.pinhole, size);
  cv::Mat1b grey;
  cv::cvtColor(view.bgr, grey, cv::COLOR_BGR2GRAY);
  grey.convertTo(view.grey, CV_32F);
  return view;
}

/// Marks, for every camera, the view nearest in time to the middle.
void mark_main_views(ViewGroup& group) {
  for (int c = 0; c < group.num_cameras; ++c) {
    View* best = nullptr;
    for (View& view : group.views)
      if (view.camera == c && (!best || std::abs(view.time_s) < std::abs(best->time_s))) best = &view;
    best->main = true;
  }
}

}  // namespace

ViewGroup make_view_group(const std::vector<GroupImage>& images, int level) {
  check(!images.empty() && images.size() <= static_cast<std::size_t>(kMaxViews), "a group has 1 to 64 images");
  ViewGroup group;
  const auto [first, last] =
      std::minmax_element(images.begin(), images.end(), [](auto& a, auto& b) { return a.time_s < b.time_s; });
  group.first_s = first->time_s;
  group.last_s = last->time_s;
  group.reference_time_s = (group.first_s + group.last_s) / 2;
  std::map<std::string, int> cameras;
  const int halvings = level_for(images, level);
  for (const GroupImage& image : images) {
    View view = make_view(image, halvings);
    view.time_s = image.time_s - group.reference_time_s;
    view.camera = cameras.emplace(image.id.camera, static_cast<int>(cameras.size())).first->second;
    group.views.push_back(std::move(view));
  }
  group.num_cameras = static_cast<int>(cameras.size());
  mark_main_views(group);
  return group;
}

Eigen::Vector3d world_ray(const View& view, const Eigen::Vector2d& px) {
  return view.cam_from_world.R.transpose() * view.pinhole.ray(px);
}

Projection project(const View& view, const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = view.cam_from_world * point;
  if (p.z() <= 1e-9) return {{-1e9, -1e9}, p.z()};
  return {view.pinhole.project(p), p.z()};
}

bool inside(const View& view, const Eigen::Vector2d& px, double margin_px) {
  return px.x() >= margin_px && px.y() >= margin_px && px.x() < view.pinhole.width - margin_px &&
         px.y() < view.pinhole.height - margin_px;
}

}  // namespace vantage
