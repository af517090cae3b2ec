#include "jobs/vision/shot_images.h"

#include <opencv2/imgcodecs.hpp>

#include "jobs/vision/camera_mask.h"
#include "jobs/vision/colour_space.h"
#include "schema/base/error.h"

namespace vantage {

namespace {

/// What becomes of each level of a BGR picture, for cv::LUT.
cv::Mat3b levels_of(const CameraColour& colour) {
  cv::Mat3b levels(1, 256);
  for (int c = 0; c < 3; ++c) {
    const auto table = level_table(colour, 2 - c);
    for (int level = 0; level < 256; ++level) levels(0, level)[c] = table[static_cast<std::size_t>(level)];
  }
  return levels;
}

cv::Mat read_as(const std::filesystem::path& path, int how) {
  cv::Mat picture = cv::imread(path.string(), how);
  if (picture.empty()) throw Error(ErrorKind::Transient, path.string() + ": cannot read the picture");
  return picture;
}

}  // namespace

ShotImages::ShotImages(const JobContext& context)
    : context_(context), calibration_(read_calibration(context.input("calibrate"))) {
  for (const CameraColour& colour : read_colours(context.input("calibrate"))) looks_[colour.name] = colour;
  if (context.has_input("align")) clocks_ = read_clocks(context.input("align"));
}

const FrameTable& ShotImages::table(const std::string& camera) {
  auto found = tables_.find(camera);
  if (found == tables_.end())
    found = tables_.emplace(camera, read_frame_table(context_.input("ingest/" + camera))).first;
  return found->second;
}

const Undistorter& ShotImages::undistorter(const std::string& camera) {
  auto found = undistorters_.find(camera);
  if (found == undistorters_.end()) found = undistorters_.emplace(camera, calibration_.camera(camera)).first;
  return found->second;
}

cv::Mat ShotImages::bgr(const ImageId& image) {
  cv::Mat bgr = read_picture(frame_path(context_.input("ingest/" + image.camera), image.frame));
  if (const auto look = looks_.find(image.camera); look != looks_.end()) cv::LUT(bgr, levels_of(look->second), bgr);
  return undistorter(image.camera).apply(bgr);
}

cv::Mat3f ShotImages::linear_bgr(const ImageId& image) {
  const cv::Mat levels = read_deep_picture(frame_path(context_.input("ingest/" + image.camera), image.frame));
  return undistorter(image.camera).apply(in_linear_light(image.camera, levels));
}

cv::Mat3f ShotImages::in_linear_light(const std::string& camera, const cv::Mat& levels) const {
  const auto look = looks_.find(camera);
  return look == looks_.end() ? linear_from_srgb(levels) : linear_from_srgb(levels, look->second);
}

cv::Vec3f ShotImages::linear_colour(const std::string& camera, const cv::Vec3b& filmed) const {
  return in_linear_light(camera, cv::Mat3b(1, 1, filmed))(0, 0);
}

cv::Mat1f ShotImages::matte(const ImageId& image) {
  const CameraMask mask(context_, table(image.camera));
  cv::Mat1f matte;
  if (mask.exists()) undistorter(image.camera).apply(mask.matte_at(image.frame)).convertTo(matte, CV_32F, 1 / 255.0);
  return matte;
}

cv::Mat1b ShotImages::mask(const ImageId& image) {
  const CameraMask mask(context_, table(image.camera));
  return mask.exists() ? undistorter(image.camera).apply_mask(mask.at(image.frame)) : cv::Mat1b();
}

double ShotImages::time_s(const ImageId& image) {
  const CameraClock* clock = clocks_.find(image.camera);
  check(clock != nullptr, "only images of cameras with a clock are asked for their time: " + image.label());
  return clock->shot_time_s(table(image.camera).pts_s.at(static_cast<std::size_t>(image.frame)));
}

cv::Mat read_picture(const std::filesystem::path& path) { return read_as(path, cv::IMREAD_COLOR); }
cv::Mat read_deep_picture(const std::filesystem::path& path) {
  return read_as(path, cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH);
}

void write_picture(const std::filesystem::path& path, const cv::Mat& picture) {
  if (!cv::imwrite(path.string(), picture, {cv::IMWRITE_PNG_COMPRESSION, 1, cv::IMWRITE_JPEG_QUALITY, 90}))
    throw Error(ErrorKind::Resource, path.string() + ": cannot write the picture");
}

}  // namespace vantage
