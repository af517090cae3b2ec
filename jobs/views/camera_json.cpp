#include "jobs/views/camera_json.h"

namespace vantage {

Json to_json(const Pinhole& p) {
  return {{"width", p.width}, {"height", p.height}, {"fx", p.fx}, {"fy", p.fy}, {"cx", p.cx}, {"cy", p.cy}};
}

Pinhole pinhole_from(const Json& j) {
  return {j.at("width"), j.at("height"), j.at("fx"), j.at("fy"), j.at("cx"), j.at("cy")};
}

Json to_json(const RigidTransform& pose) {
  Json numbers = Json::array();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) numbers.push_back(pose.R(r, c));
  for (int r = 0; r < 3; ++r) numbers.push_back(pose.t[r]);
  return numbers;
}

RigidTransform pose_from(const Json& j) {
  RigidTransform pose;
  for (std::size_t k = 0; k < 9; ++k) pose.R(static_cast<int>(k / 3), static_cast<int>(k % 3)) = j.at(k).get<double>();
  for (std::size_t k = 0; k < 3; ++k) pose.t[static_cast<int>(k)] = j.at(9 + k).get<double>();
  return pose;
}

}  // namespace vantage
