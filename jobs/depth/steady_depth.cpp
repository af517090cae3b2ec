#include "jobs/depth/steady_depth.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "jobs/depth/votes.h"

namespace vantage {

DepthMap carried_depth(const DepthFrame& frame, const Pinhole& pinhole, const RigidTransform& cam_from_world) {
  const cv::Size size = frame.to_frame.motion_px.size();
  DepthMap out{cv::Mat1f(size, 0.0F), cv::Mat1f(size, 0.0F)};
  const Eigen::Matrix3d turn = cam_from_world.R * frame.cam_from_world.R.transpose();
  const double shift_z = (cam_from_world.t - turn * frame.cam_from_world.t).z();
  const Eigen::Vector3d z_row = turn.row(2).transpose();
  const cv::Rect inside({}, frame.depth.z.size());
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const cv::Vec2f motion = frame.to_frame.motion_px(y, x);
      const Eigen::Vector2d px(x + 0.5 + motion[0], y + 0.5 + motion[1]);
      const float sure = frame.to_frame.confidence(y, x);
      if (sure <= 0 || !(px.cwiseAbs().maxCoeff() < 1e6)) continue;
      const cv::Point at(static_cast<int>(std::floor(px.x())), static_cast<int>(std::floor(px.y())));
      if (!inside.contains(at) || frame.depth.z(at) <= 0) continue;
      const double z = static_cast<double>(frame.depth.z(at)) * z_row.dot(pinhole.ray(px)) + shift_z;
      if (z <= 0) continue;
      out.z(y, x) = static_cast<float>(z);
      out.confidence(y, x) = sure * frame.depth.confidence(at);
    }
  return out;
}

DepthMap steady_depth(const DepthMap& own, std::span<const DepthMap> carried, double agreement) {
  if (carried.empty()) return own;
  DepthMap out{cv::Mat1f(own.z.size(), 0.0F), cv::Mat1f(own.z.size(), 0.0F)};
  std::vector<DepthVote> votes;
  for (int y = 0; y < own.z.rows; ++y)
    for (int x = 0; x < own.z.cols; ++x) {
      votes.clear();
      float surest = 0;
      const auto hear = [&](const DepthMap& map) {
        if (map.confidence(y, x) <= 0) return;
        votes.push_back({1 / map.z(y, x), map.confidence(y, x)});
        surest = std::max(surest, map.confidence(y, x));
      };
      hear(own);
      for (const DepthMap& map : carried) hear(map);
      if (votes.empty()) continue;
      const Consensus consensus = consensus_of(votes, static_cast<float>(agreement));
      out.z(y, x) = 1 / consensus.inverse_depth;
      const float outvoted_at = static_cast<float>(agreement) * consensus.inverse_depth;
      const bool own_holds = own.z(y, x) > 0 && std::abs(1 / own.z(y, x) - consensus.inverse_depth) <= outvoted_at;
      // Frames that differ, as where things come nearer, take nothing from what the image's own edges agree on.
      out.confidence(y, x) = std::max(surest * consensus.share, own_holds ? own.confidence(y, x) : 0.0F);
    }
  return out;
}

}  // namespace vantage
