#include "jobs/groups/image_groups.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "schema/base/median.h"
#include "schema/formats/calibration.h"
#include "schema/formats/clocks.h"
#include "schema/formats/frame_table.h"

namespace vantage {
namespace {

/// The point nearest to all optical axes; parallel axes: the middle of the cameras.
Eigen::Vector3d looked_at(const std::vector<GroupCamera>& cameras) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero(), middle = Eigen::Vector3d::Zero();
  for (const auto& c : cameras) {
    const Eigen::Matrix3d P = Eigen::Matrix3d::Identity() - c.forward * c.forward.transpose();
    normal += P;
    right += P * c.centre;
    middle += c.centre / static_cast<double>(cameras.size());
  }
  const Eigen::FullPivLU<Eigen::Matrix3d> lu(normal);
  return lu.rcond() > 1e-6 ? Eigen::Vector3d(lu.solve(right)) : middle;
}

/// Azimuth of each camera about the point they look at, radians.
std::vector<double> azimuths(const std::vector<GroupCamera>& cameras) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero(), forward = Eigen::Vector3d::Zero();
  for (const auto& c : cameras) {
    up += c.up;
    forward += c.forward;
  }
  const Eigen::Vector3d axis = up.norm() > 1e-9 ? up.normalized() : cameras.front().up;
  Eigen::Vector3d front = -forward + forward.dot(axis) * axis;
  if (front.norm() < 1e-6) front = axis.unitOrthogonal();
  front.normalize();
  const Eigen::Vector3d side = axis.cross(front), centre = looked_at(cameras);
  std::vector<double> out;
  for (const auto& c : cameras) out.push_back(std::atan2(side.dot(c.centre - centre), front.dot(c.centre - centre)));
  return out;
}

/// Cameras in order of azimuth, starting after the largest gap, and whether that gap is small enough to be a ring.
std::pair<std::vector<int>, bool> around_the_scene(const std::vector<GroupCamera>& cameras) {
  const std::vector<double> azimuth = azimuths(cameras);
  std::vector<int> order(cameras.size());
  std::iota(order.begin(), order.end(), 0);
  const auto angle = [&](int i) { return azimuth[static_cast<std::size_t>(i)]; };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return angle(a) < angle(b); });
  std::size_t first = 0;
  double widest = 2 * std::numbers::pi - (angle(order.back()) - angle(order.front()));
  for (std::size_t k = 1; k < order.size(); ++k)
    if (const double gap = angle(order[k]) - angle(order[k - 1]); gap > widest) {
      widest = gap;
      first = k;
    }
  std::rotate(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(first), order.end());
  return {order, widest < std::numbers::pi / 2};
}

/// Typical time between frames; 0 when no camera has two.
double frame_interval_s(const std::vector<GroupCamera>& cameras) {
  std::vector<double> intervals;
  for (const auto& c : cameras)
    for (std::size_t k = 1; k < c.images.size(); ++k) intervals.push_back(c.images[k].time_s - c.images[k - 1].time_s);
  return intervals.empty() ? 0 : median(intervals);
}

struct Window {
  double from_s, to_s;  ///< half open
};

std::vector<Window> windows(const std::vector<GroupCamera>& cameras, int group_frames) {
  double first = std::numeric_limits<double>::infinity(), last = -first;
  for (const auto& c : cameras)
    for (const auto& i : c.images) {
      first = std::min(first, i.time_s);
      last = std::max(last, i.time_s);
    }
  const double interval = frame_interval_s(cameras);
  if (interval <= 0) return {{first, last + 1}};
  const double length = group_frames * interval, stride = (group_frames + 1) / 2 * interval;
  const double slack = 0.01 * interval;  // time stamps jitter by rounding; a frame on the edge must not flip sides
  std::vector<Window> out;
  for (double from = first; out.empty() || from + length - stride <= last + slack; from += stride)
    out.push_back({from - slack, from + length - slack});
  return out;
}

/// Images of a camera in a window, thinned evenly to at most most.
std::vector<ImageId> images_in(const GroupCamera& camera, const Window& window, std::size_t most) {
  std::vector<ImageId> all;
  for (const auto& i : camera.images)
    if (i.time_s >= window.from_s && i.time_s < window.to_s) all.push_back({camera.name, i.frame});
  if (all.size() <= most) return all;
  std::vector<ImageId> some;
  for (std::size_t k = 0; k < most; ++k) some.push_back(all[k * (all.size() - 1) / std::max<std::size_t>(1, most - 1)]);
  return some;
}

std::vector<ImageId> group_of(const std::vector<GroupCamera>& cameras, const std::vector<int>& members,
                              const Window& window) {
  std::vector<ImageId> group;
  std::size_t num_cameras = 0;
  for (const int c : members) {
    const auto images = images_in(cameras[static_cast<std::size_t>(c)], window, kMaxGroupImages / members.size());
    num_cameras += !images.empty();
    group.insert(group.end(), images.begin(), images.end());
  }
  if (num_cameras < 2 || group.size() < 3) group.clear();
  return group;
}

/// The cameras that can take part, or nothing while calibration, clocks or frames are not there yet.
std::optional<std::vector<GroupCamera>> group_cameras(const ShotState& state) {
  const auto calibrated = state.artifact("calibrate"), aligned = state.artifact("align");
  if (!calibrated || !aligned) return std::nullopt;
  const Calibration calibration = read_calibration(*calibrated);
  const Clocks clocks = read_clocks(*aligned);
  std::vector<GroupCamera> out;
  for (const ShotCamera& camera : state.shot().cameras) {
    const CameraClock* clock = clocks.find(camera.name);
    const auto ingested = state.artifact("ingest/" + camera.name);
    if (!ingested) return std::nullopt;
    if (!clock || !calibration.cameras.contains(camera.name)) continue;
    const FrameTable table = read_frame_table(*ingested);
    GroupCamera group{.name = camera.name, .images = {}};
    Eigen::Vector3d centre = Eigen::Vector3d::Zero(), forward = centre, up = centre;
    for (int k = 0; k < table.num_frames(); ++k) {
      const auto pose = calibration.cam_from_world.find({camera.name, k});
      if (pose == calibration.cam_from_world.end()) continue;
      group.images.push_back({k, clock->shot_time_s(table.pts_s[static_cast<std::size_t>(k)])});
      centre += pose->second.centre();
      forward += pose->second.R.row(2).transpose();
      up -= pose->second.R.row(1).transpose();
    }
    if (group.images.empty()) continue;
    group.centre = centre / static_cast<double>(group.images.size());
    group.forward = forward.normalized();
    group.up = up.normalized();
    out.push_back(std::move(group));
  }
  return out;
}

}  // namespace

std::vector<std::vector<int>> camera_neighbourhoods(const std::vector<GroupCamera>& cameras) {
  const int count = static_cast<int>(cameras.size());
  const auto [order, ring] = around_the_scene(cameras);
  if (count <= kMaxGroupCameras) return {order};
  std::vector<std::vector<int>> out;
  const int last_start = ring ? count - 1 : count - kMaxGroupCameras;
  for (int start = 0;; start = std::min(start + kMaxGroupCameras / 2, last_start)) {
    std::vector<int> members;
    for (int k = 0; k < kMaxGroupCameras; ++k) members.push_back(order[static_cast<std::size_t>((start + k) % count)]);
    out.push_back(std::move(members));
    if (start >= last_start || (ring && start + kMaxGroupCameras / 2 >= count)) return out;
  }
}

std::vector<std::vector<ImageId>> image_groups(const std::vector<GroupCamera>& cameras, int group_frames) {
  std::vector<std::vector<ImageId>> groups;
  if (cameras.size() < 2) return groups;
  const auto neighbourhoods = camera_neighbourhoods(cameras);
  for (const Window& window : windows(cameras, group_frames))
    for (const auto& members : neighbourhoods)
      if (auto group = group_of(cameras, members, window); !group.empty()) groups.push_back(std::move(group));
  return groups;
}

std::optional<std::vector<std::vector<ImageId>>> planned_groups(const ShotState& state) {
  const auto cameras = group_cameras(state);
  if (!cameras) return std::nullopt;
  int group_frames = kDefaultGroupFrames;
  const Section section = state.shot().section("reconstruct");
  if (const auto found = section.values.find("group_frames"); found != section.values.end())
    group_frames = found->second.value.get<int>();
  return image_groups(*cameras, group_frames);
}

std::string group_job_name(std::size_t number) { return fmt::format("reconstruct/{:04d}", number); }

}  // namespace vantage
