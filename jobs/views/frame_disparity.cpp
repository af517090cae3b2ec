#include "jobs/views/frame_disparity.h"

namespace vantage {
namespace {

/// Calls field(name, member) for each member.
void fields(auto& d, auto&& field) {
  field("nearest_percent", d.nearest_percent);
  field("p0_1_percent", d.p0_1_percent);
  field("p5_percent", d.p5_percent);
  field("p50_percent", d.p50_percent);
  field("p95_percent", d.p95_percent);
  field("p99_9_percent", d.p99_9_percent);
  field("farthest_percent", d.farthest_percent);
  field("too_near_share", d.too_near_share);
  field("too_far_share", d.too_far_share);
  field("cut_left_share", d.cut_left_share);
  field("cut_right_share", d.cut_right_share);
  field("cut_percent", d.cut_percent);
}

}  // namespace

Json to_json(const FrameDisparity& disparity) {
  Json json = Json::object();
  fields(disparity, [&](const char* name, double value) { json[name] = value; });
  return json;
}

void write_frame_disparity(const std::filesystem::path& file, const FrameDisparity& disparity) {
  write_json(file, to_json(disparity));
}

FrameDisparity read_frame_disparity(const std::filesystem::path& file) {
  const Json json = read_json(file);
  FrameDisparity disparity;
  fields(disparity, [&](const char* name, double& value) { value = json.at(name).get<double>(); });
  return disparity;
}

}  // namespace vantage
