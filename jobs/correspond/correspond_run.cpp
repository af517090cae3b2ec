#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "jobs/correspond/correspond_job.h"
#include "jobs/correspond/flow_pair.h"
#include "jobs/correspond/match_images.h"
#include "jobs/vision/shot_images.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr int kTileWidth = 400;

ImageId image_of(const JobContext& context, const char* key) {
  const auto image = ImageId::parse(context.unit().at(key).get<std::string>());
  check(image.has_value(), "the unit of a correspond job names two images");
  return *image;
}

PosedPicture posed(ShotImages& images, const ImageId& image, const cv::Mat& bgr) {
  PosedPicture picture{{}, images.pinhole(image), images.cam_from_world(image)};
  cv::cvtColor(bgr, picture.grey, cv::COLOR_BGR2GRAY);
  return picture;
}

/// No confidence where a person's mask says that a pixel, or the one that it moves to, does not count. Masks may be
/// empty: everything counts.
void ignore_masked(const cv::Mat1b& from_counts, const cv::Mat1b& to_counts, FlowMap& flow) {
  if (!from_counts.empty()) flow.confidence.setTo(0, from_counts == 0);
  if (to_counts.empty()) return;
  const cv::Rect inside({}, to_counts.size());
  for (int y = 0; y < flow.confidence.rows; ++y)
    for (int x = 0; x < flow.confidence.cols; ++x) {
      const cv::Vec2f motion = flow.motion_px(y, x);
      const cv::Point to(cvRound(static_cast<float>(x) + motion[0]), cvRound(static_cast<float>(y) + motion[1]));
      if (inside.contains(to) && to_counts(to) == 0) flow.confidence(y, x) = 0;
    }
}

/// Colours reach full saturation at the longest motion that is not an outlier.
double longest_motion_px(const FlowMap& flow) {
  std::vector<float> lengths;
  for (int y = 0; y < flow.motion_px.rows; y += 4)
    for (int x = 0; x < flow.motion_px.cols; x += 4)
      if (flow.confidence(y, x) > 0) lengths.push_back(static_cast<float>(cv::norm(flow.motion_px(y, x))));
  if (lengths.empty()) return 1;
  const auto late = lengths.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(lengths.size() - 1));
  std::nth_element(lengths.begin(), late, lengths.end());
  return std::max(1.0F, *late);
}

/// What colour which motion has, and how long it is at full saturation.
cv::Mat legend(cv::Size size, double max_px) {
  FlowMap all{cv::Mat2f(size, cv::Vec2f(0, 0)), cv::Mat1f(size, 0.0F)};
  const float radius = 0.4F * static_cast<float>(std::min(size.width, size.height));
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const cv::Vec2f out(static_cast<float>(x - size.width / 2), static_cast<float>(y - size.height / 2));
      all.motion_px(y, x) = out * (static_cast<float>(max_px) / radius);
      all.confidence(y, x) = cv::norm(out) <= radius ? 1.0F : 0.0F;
    }
  cv::Mat picture = flow_picture(all, max_px);
  cv::putText(picture, cv::format("rim: %.1f px", max_px), {8, size.height - 10}, cv::FONT_HERSHEY_SIMPLEX, 0.5,
              {255, 255, 255}, 1, cv::LINE_AA);
  return picture;
}

/// The first picture, darker, red where nothing in the second matches, yellow where a match is doubtful.
cv::Mat doubts(const cv::Mat& first, const FlowMap& forward) {
  cv::Mat picture = first * 0.6;
  picture.setTo(cv::Scalar(0, 200, 230), forward.confidence < 0.5F);
  picture.setTo(cv::Scalar(40, 40, 200), forward.confidence <= 0);
  return picture;
}

/// Above: first picture, second, second brought onto the first (black where hidden). Below: motion from the first to
/// the second, its legend, where there is no match.
cv::Mat preview(const cv::Mat& first, const cv::Mat& second, const FlowMap& forward) {
  const double max_px = longest_motion_px(forward);
  cv::Mat brought = warp_back(second, forward.motion_px, cv::INTER_LINEAR);
  brought.setTo(0, forward.confidence <= 0);
  const cv::Size size(kTileWidth, std::max(1, kTileWidth * first.rows / first.cols));
  std::vector<cv::Mat> above{first, second, brought},
      below{flow_picture(forward, max_px), legend(size, max_px), doubts(first, forward)};
  std::vector<cv::Mat> rows(2);
  for (auto* row : {&above, &below})
    for (cv::Mat& tile : *row)
      if (cv::Mat small; tile.size() != size) {
        cv::resize(tile, small, size, 0, 0, cv::INTER_AREA);
        tile = small;
      }
  cv::hconcat(above, rows[0]);
  cv::hconcat(below, rows[1]);
  cv::Mat sheet;
  cv::vconcat(rows, sheet);
  return sheet;
}

}  // namespace

void CorrespondJob::run(JobContext& context, const Params& params) {
  const ImageId first = image_of(context, "first"), second = image_of(context, "second");
  ShotImages images(context);
  const cv::Mat bgr_first = images.bgr(first), bgr_second = images.bgr(second);
  const PosedPicture a = posed(images, first, bgr_first), b = posed(images, second, bgr_second);

  context.progress(0.1, "matching");
  const MatchOptions options{
      .consistent_px = static_cast<float>(params.consistent_px),
      .stereo = {.max_pixels = static_cast<int>(1e6 * params.max_stereo_megapixels), .max_labels = params.max_depths}};
  ImageMatch match = match_images(a, b, options);
  const cv::Mat1b first_counts = images.mask(first), second_counts = images.mask(second);
  ignore_masked(first_counts, second_counts, match.forward);
  ignore_masked(second_counts, first_counts, match.backward);

  context.progress(0.9, "writing");
  write_flow(context.out("forward.exr"), match.forward);
  write_flow(context.out("backward.exr"), match.backward);
  write_picture(context.out("preview.jpg"), preview(bgr_first, bgr_second, match.forward));
  context.figure("consistent_percent", confident_percent(match.forward));
  if (match.model == ImageMatch::Model::StaticScene)
    context.figure("epipolar_residual_median_px", median_epipolar_residual_px(match, a, b));
}

}  // namespace vantage
