#include "jobs/calibrate/frame_poses.h"

#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <optional>

#include "jobs/calibrate/smooth_path.h"
#include "jobs/vision/undistort.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr int kMinPoints = 12;         // PnP needs 4; fewer than this are one object's or chance
constexpr double kMaxErrorPx = 2.0;    // KLT drift over a key frame's interval stays well below
constexpr double kLeastNoisePx = 0.1;  // followed points are never surer
constexpr double kMaxReturnPx = 0.7;   // a point followed there and back must come home

/// Points of the model and where they are in one picture, in undistorted pixels (OpenCV's: centres at integers).
struct Seen {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2f> px;
};

Seen seen_in_key_frame(const SparseModel& model, const ImageId& image, const Pinhole& pinhole) {
  Seen out;
  for (const auto& o : model.observations) {
    if (o.image != image) continue;
    const Eigen::Vector3d& p = model.points[static_cast<std::size_t>(o.point)].position;
    const Eigen::Vector2d px = pinhole.project(model.cam_from_world.at(image) * p);
    out.points.emplace_back(p.x(), p.y(), p.z());
    out.px.emplace_back(static_cast<float>(px.x() - 0.5), static_cast<float>(px.y() - 0.5));
  }
  return out;
}

/// The points that are found again in the next picture.
Seen follow(const Seen& seen, const cv::Mat& from, const cv::Mat& to) {
  Seen out;
  if (seen.px.empty()) return out;
  std::vector<cv::Point2f> there, back;
  std::vector<uchar> found, returned;
  const cv::Size window(21, 21);
  cv::calcOpticalFlowPyrLK(from, to, seen.px, there, found, cv::noArray(), window, 4);
  cv::calcOpticalFlowPyrLK(to, from, there, back, returned, cv::noArray(), window, 4);
  for (std::size_t i = 0; i < seen.px.size(); ++i) {
    if (!found[i] || !returned[i] || cv::norm(back[i] - seen.px[i]) > kMaxReturnPx) continue;
    out.points.push_back(seen.points[i]);
    out.px.push_back(there[i]);
  }
  return out;
}

/// Derivative of a point's pixel by the pose's (turn, shift), see MeasuredPose.
Eigen::Matrix<double, 2, 6> pixel_by_pose(const Eigen::Vector3d& p, const Pinhole& pinhole) {
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << pinhole.fx / p.z(), 0, -pinhole.fx * p.x() / (p.z() * p.z()), 0, pinhole.fy / p.z(),
      -pinhole.fy * p.y() / (p.z() * p.z());
  Eigen::Matrix3d cross;
  cross << 0, -p.z(), p.y(), p.z(), 0, -p.x(), -p.y(), p.x(), 0;
  Eigen::Matrix<double, 2, 6> out;
  out << -by_point * cross, by_point;
  return out;
}

/// The pose with what its points say of it, their noise taken from how well they fit.
MeasuredPose with_information(const Seen& seen, const Pinhole& pinhole, const RigidTransform& pose) {
  MeasuredPose out{.cam_from_world = pose};
  double sum_squares = 0;
  for (std::size_t i = 0; i < seen.points.size(); ++i) {
    const Eigen::Vector3d p = pose * Eigen::Vector3d(seen.points[i].x, seen.points[i].y, seen.points[i].z);
    const Eigen::Vector2d px = pinhole.project(p);
    sum_squares += std::pow(px.x() - 0.5 - static_cast<double>(seen.px[i].x), 2) +
                   std::pow(px.y() - 0.5 - static_cast<double>(seen.px[i].y), 2);
    const auto J = pixel_by_pose(p, pinhole);
    out.information += J.transpose() * J;
  }
  const double variance = sum_squares / std::max(1.0, 2 * static_cast<double>(seen.points.size()) - 6);
  out.information /= std::max(variance, kLeastNoisePx * kLeastNoisePx);
  return out;
}

std::optional<MeasuredPose> place(const Seen& seen, const Pinhole& pinhole) {
  if (seen.points.size() < kMinPoints) return std::nullopt;
  const cv::Matx33d K(pinhole.fx, 0, pinhole.cx - 0.5, 0, pinhole.fy, pinhole.cy - 0.5, 0, 0, 1);
  cv::Mat turn, shift, inliers;
  cv::theRNG().state = 1;  // RANSAC's samples
  if (!cv::solvePnPRansac(seen.points, seen.px, K, cv::noArray(), turn, shift, false, 300, kMaxErrorPx, 0.999, inliers,
                          cv::SOLVEPNP_EPNP))
    return std::nullopt;
  if (inliers.rows < kMinPoints) return std::nullopt;
  Seen good;
  for (int i = 0; i < inliers.rows; ++i) {
    good.points.push_back(seen.points[static_cast<std::size_t>(inliers.at<int>(i))]);
    good.px.push_back(seen.px[static_cast<std::size_t>(inliers.at<int>(i))]);
  }
  cv::solvePnPRefineLM(good.points, good.px, K, cv::noArray(), turn, shift);
  cv::Mat rotation;
  cv::Rodrigues(turn, rotation);
  RigidTransform pose;
  cv::cv2eigen(rotation, pose.R);
  cv::cv2eigen(shift, pose.t);
  return with_information(good, pinhole, pose);
}

RigidTransform between(const RigidTransform& a, const RigidTransform& b, double share_of_b) {
  RigidTransform out;
  const Eigen::Quaterniond qa(a.R), qb(b.R);
  out.R = qa.slerp(share_of_b, qb).toRotationMatrix();
  out.t = -out.R * ((1 - share_of_b) * a.centre() + share_of_b * b.centre());
  return out;
}

/// A pose for every frame: where none was found one between or beside its neighbours, without information.
std::vector<MeasuredPose> without_gaps(const std::map<int, MeasuredPose>& placed, int num_frames) {
  std::vector<MeasuredPose> out;
  for (int frame = 0; frame < num_frames; ++frame) {
    const auto after = placed.lower_bound(frame);
    if (after != placed.end() && after->first == frame)
      out.push_back(after->second);
    else if (after == placed.begin())
      out.push_back({.cam_from_world = after->second.cam_from_world});
    else if (after == placed.end())
      out.push_back({.cam_from_world = placed.rbegin()->second.cam_from_world});
    else {
      const auto before = std::prev(after);
      const double share = static_cast<double>(frame - before->first) / (after->first - before->first);
      out.push_back({.cam_from_world = between(before->second.cam_from_world, after->second.cam_from_world, share)});
    }
  }
  return out;
}

/// The pictures and key frames of one camera, between two neighbouring key frames at a time.
class Placer {
 public:
  Placer(const SparseModel& model, const std::string& camera, const std::function<cv::Mat(int)>& frame_bgr)
      : model_(model),
        camera_(camera),
        frame_bgr_(frame_bgr),
        pinhole_(undistorted_pinhole(model.lenses.at(camera))),
        undistorter_({.name = camera, .id = 0, .pinhole = pinhole_, .filmed = model.lenses.at(camera)}) {}

  /// A key frame's pose, as sure as the points that it holds make it.
  MeasuredPose key_pose(const ImageId& image) const {
    return with_information(seen_in_key_frame(model_, image, pinhole_), pinhole_, model_.cam_from_world.at(image));
  }

  /// Places frames first..last; from_first and from_last: whether these are key frames to start from.
  void place_span(int first, int last, bool from_first, bool from_last, std::map<int, MeasuredPose>& out) {
    std::vector<cv::Mat> grey;
    for (int frame = first; frame <= last; ++frame) grey.push_back(picture(frame));
    std::vector<Seen> seen(grey.size());
    if (from_first) follow_through(grey, seen, first, 1);
    if (from_last) follow_through(grey, seen, last, -1);
    for (int frame = first; frame <= last; ++frame)
      if (!out.contains(frame))
        if (const auto pose = place(seen[static_cast<std::size_t>(frame - first)], pinhole_)) out[frame] = *pose;
  }

 private:
  cv::Mat picture(int frame) const {
    cv::Mat grey;
    cv::cvtColor(undistorter_.apply(frame_bgr_(frame)), grey, cv::COLOR_BGR2GRAY);
    return grey;
  }

  void follow_through(const std::vector<cv::Mat>& grey, std::vector<Seen>& seen, int key_frame, int step) const {
    Seen now = seen_in_key_frame(model_, {camera_, key_frame}, pinhole_);
    const int num = static_cast<int>(grey.size());
    for (int i = step > 0 ? 0 : num - 1; i + step >= 0 && i + step < num; i += step) {
      now = follow(now, grey[static_cast<std::size_t>(i)], grey[static_cast<std::size_t>(i + step)]);
      Seen& all = seen[static_cast<std::size_t>(i + step)];
      all.points.insert(all.points.end(), now.points.begin(), now.points.end());
      all.px.insert(all.px.end(), now.px.begin(), now.px.end());
    }
  }

  const SparseModel& model_;
  const std::string& camera_;
  const std::function<cv::Mat(int)>& frame_bgr_;
  Pinhole pinhole_;
  Undistorter undistorter_;
};

}  // namespace

FramePoses place_frames(const SparseModel& model, const std::string& camera, const std::vector<double>& times_s,
                        const std::function<cv::Mat(int)>& frame_bgr) {
  const int num_frames = static_cast<int>(times_s.size());
  Placer placer(model, camera, frame_bgr);
  std::map<int, MeasuredPose> placed;
  std::vector<int> keys;
  for (const auto& [image, pose] : model.cam_from_world)
    if (image.camera == camera) {
      keys.push_back(image.frame);
      placed[image.frame] = placer.key_pose(image);
    }
  check(!keys.empty(), "a camera is placed from its key frames");
  // A long gap without key frames would hold too many pictures in memory, and drift: beyond this it is interpolated.
  constexpr int kMaxSpan = 90;
  if (keys.front() > 0) placer.place_span(std::max(0, keys.front() - kMaxSpan), keys.front(), false, true, placed);
  for (std::size_t k = 0; k + 1 < keys.size(); ++k) {
    if (keys[k + 1] - keys[k] <= 2 * kMaxSpan) {
      placer.place_span(keys[k], keys[k + 1], true, true, placed);
      continue;
    }
    placer.place_span(keys[k], keys[k] + kMaxSpan, true, false, placed);
    placer.place_span(keys[k + 1] - kMaxSpan, keys[k + 1], false, true, placed);
  }
  if (keys.back() + 1 < num_frames)
    placer.place_span(keys.back(), std::min(num_frames - 1, keys.back() + kMaxSpan), true, false, placed);
  std::vector<MeasuredPose> path = without_gaps(placed, num_frames);
  smooth_path(times_s, path);
  FramePoses out{.cam_from_world = {}, .num_interpolated = num_frames - static_cast<int>(placed.size())};
  for (int frame = 0; frame < num_frames; ++frame)
    out.cam_from_world[frame] = path[static_cast<std::size_t>(frame)].cam_from_world;
  return out;
}

}  // namespace vantage
