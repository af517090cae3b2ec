#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>
#include <vector>

#include "jobs/depth/depth_job.h"
#include "jobs/depth/fuse_depth.h"
#include "jobs/depth/regularise.h"
#include "jobs/depth/triangulate_edge.h"
#include "jobs/vision/shot_images.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr int kPreviewWidth = 480;

ImageId image_of(const Json& json, const char* key) {
  const auto image = ImageId::parse(json.at(key).get<std::string>());
  check(image.has_value(), "the unit of a depth job names images");
  return *image;
}

FlowMap flow_of(const JobContext& context, const Json& link) {
  const bool forward = link.at("forward").get<bool>();
  return read_flow(context.input(link.at("job").get<std::string>()) / (forward ? "forward.exr" : "backward.exr"));
}

EdgeDepth depth_of_edge(const JobContext& context, const ShotImages& images, const ImageId& image, const Json& edge,
                        const DepthJob::Params& params) {
  const ImageId other = image_of(edge, "other");
  std::optional<StepFlow> step;
  if (edge.contains("step")) step = {flow_of(context, edge.at("step")), edge.at("step").at("duration_s").get<double>()};
  const TwoView views(images.pinhole(image), images.cam_from_world(image), images.pinhole(other),
                      images.cam_from_world(other));
  return triangulate_edge(views, images.pinhole(other).fx, flow_of(context, edge), edge.at("lag_s").get<double>(), step,
                          {.max_epipolar_px = params.max_epipolar_px, .min_angle_deg = params.min_angle_deg});
}

cv::Mat preview(const cv::Mat& bgr, const DepthMap& depth) {
  std::vector<cv::Mat> tiles{bgr, depth_picture(depth)};
  const int width = kPreviewWidth / static_cast<int>(tiles.size());
  for (cv::Mat& tile : tiles)
    cv::resize(tile, tile, cv::Size(width, std::max(1, width * bgr.rows / bgr.cols)), 0, 0, cv::INTER_AREA);
  cv::Mat row;
  cv::hconcat(tiles, row);
  return row;
}

double known_percent(const cv::Mat& known) {
  return 100.0 * cv::countNonZero(known) / static_cast<double>(known.total());
}

}  // namespace

void DepthJob::run(JobContext& context, const Params& params) {
  const ImageId image = image_of(context.unit(), "image");
  ShotImages images(context);
  const Json& edges = context.unit().at("edges");
  std::vector<EdgeDepth> depths;
  for (const Json& edge : edges) {
    context.progress(0.8 * static_cast<double>(depths.size()) / static_cast<double>(edges.size()), "triangulating");
    depths.push_back(depth_of_edge(context, images, image, edge, params));
  }
  context.progress(0.8, "fusing");
  const cv::Mat bgr = images.bgr(image);
  const double agreement = params.agreement_percent / 100;
  const DepthMap depth = regularise(fuse_depths(depths, agreement), bgr,
                                    {.agreement = agreement, .max_gap_percent = params.max_gap_percent});

  context.progress(0.9, "writing");
  write_depth(context.out("depth.exr"), depth);
  write_picture(context.out("preview.jpg"), preview(bgr, depth));
  const double known = known_percent(depth.z > 0);
  context.figure("edges", edges.size());
  context.figure("known_percent", known);
  context.figure("agreed_percent", known_percent(depth.confidence > kLoneConfidence));
  if (known < 10)
    context.warn("depth is known on " + std::to_string(static_cast<int>(known)) + " % of " + image.label() +
                 " only: its edges hardly match");
}

}  // namespace vantage
