#include "jobs/calibrate/frame_poses.h"

#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <optional>

#include "jobs/vision/undistort.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr int kMinPoints = 12;        // PnP needs 4; fewer than this are one object's or chance
constexpr double kMaxErrorPx = 2.0;   // KLT drift over a key frame's interval stays well below
constexpr double kMaxReturnPx = 0.7;  // a point followed there and back must come home

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

std::optional<RigidTransform> place(const Seen& seen, const Pinhole& pinhole) {
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
  return pose;
}

RigidTransform between(const RigidTransform& a, const RigidTransform& b, double share_of_b) {
  RigidTransform out;
  const Eigen::Quaterniond qa(a.R), qb(b.R);
  out.R = qa.slerp(share_of_b, qb).toRotationMatrix();
  out.t = -out.R * ((1 - share_of_b) * a.centre() + share_of_b * b.centre());
  return out;
}

void fill_gaps(FramePoses& poses, int num_frames) {
  const auto placed = poses.cam_from_world;
  for (int frame = 0; frame < num_frames; ++frame) {
    const auto after = placed.lower_bound(frame);
    if (after != placed.end() && after->first == frame) continue;
    ++poses.num_interpolated;
    if (after == placed.begin())
      poses.cam_from_world[frame] = after->second;
    else if (after == placed.end())
      poses.cam_from_world[frame] = placed.rbegin()->second;
    else {
      const auto before = std::prev(after);
      const double share = static_cast<double>(frame - before->first) / (after->first - before->first);
      poses.cam_from_world[frame] = between(before->second, after->second, share);
    }
  }
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

  /// Places frames first..last; from_first and from_last: whether these are key frames to start from.
  void place_span(int first, int last, bool from_first, bool from_last, std::map<int, RigidTransform>& out) {
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

FramePoses place_frames(const SparseModel& model, const std::string& camera, int num_frames,
                        const std::function<cv::Mat(int)>& frame_bgr) {
  FramePoses out;
  std::vector<int> keys;
  for (const auto& [image, pose] : model.cam_from_world)
    if (image.camera == camera) {
      keys.push_back(image.frame);
      out.cam_from_world[image.frame] = pose;
    }
  check(!keys.empty(), "a camera is placed from its key frames");
  Placer placer(model, camera, frame_bgr);
  // A long gap without key frames would hold too many pictures in memory, and drift: beyond this it is interpolated.
  constexpr int kMaxSpan = 90;
  if (keys.front() > 0)
    placer.place_span(std::max(0, keys.front() - kMaxSpan), keys.front(), false, true, out.cam_from_world);
  for (std::size_t k = 0; k + 1 < keys.size(); ++k) {
    if (keys[k + 1] - keys[k] <= 2 * kMaxSpan) {
      placer.place_span(keys[k], keys[k + 1], true, true, out.cam_from_world);
      continue;
    }
    placer.place_span(keys[k], keys[k] + kMaxSpan, true, false, out.cam_from_world);
    placer.place_span(keys[k + 1] - kMaxSpan, keys[k + 1], false, true, out.cam_from_world);
  }
  if (keys.back() + 1 < num_frames)
    placer.place_span(keys.back(), std::min(num_frames - 1, keys.back() + kMaxSpan), true, false, out.cam_from_world);
  fill_gaps(out, num_frames);
  return out;
}

}  // namespace vantage
