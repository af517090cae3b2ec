#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "jobs/ingest/footage.h"
#include "jobs/vision/colour_space.h"
#include "schema/base/error.h"
#include "schema/formats/exr.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(const fs::path& file, const std::string& what) {
  throw Error(ErrorKind::BadInput, fmt::format("{}: {}", file.string(), what));
}

cv::Mat read_exr_still(const fs::path& file) {
  const Channels channels = read_exr(file);
  const bool is_grey = channels.contains("Y");
  std::vector<const Plane*> bgr;
  for (const char* name : {"B", "G", "R"}) {
    const auto found = channels.find(is_grey ? "Y" : name);
    if (found == channels.end()) fail(file, fmt::format("has no channel {}, expected R, G and B, or Y", name));
    bgr.push_back(&found->second);
  }
  cv::Mat3f linear(bgr[0]->height, bgr[0]->width);
  for (std::size_t i = 0; i < linear.total(); ++i)
    for (int c = 0; c < 3; ++c) linear.ptr<cv::Vec3f>()[i][c] = bgr[static_cast<std::size_t>(c)]->values[i];
  return srgb16_from_linear(linear);
}

bool is_exr(const fs::path& file) {
  const std::string suffix = file.extension().string();
  return suffix == ".exr" || suffix == ".EXR";
}

class Stills : public Footage {
 public:
  Stills(std::vector<fs::path> files, double fps) : files_(std::move(files)), fps_(fps) {}

  cv::Mat next() override {
    if (index_ == files_.size()) return {};
    const fs::path& file = files_[index_++];
    cv::Mat bgr = read_still(file);
    if (size_.empty()) size_ = bgr.size(), bits_ = static_cast<int>(8 * bgr.elemSize1());
    if (bgr.size() != size_)
      fail(file, fmt::format("is {}x{} px, expected {}x{} px as the pictures before it", bgr.cols, bgr.rows,
                             size_.width, size_.height));
    return bgr;
  }

  int num_promised() const override { return static_cast<int>(files_.size()); }
  bool is_truncated() const override { return false; }

  double start_on_files_clock_s() const override { return 0; }

  double last_time_s() const override { return (static_cast<double>(index_) - 1) / fps_; }
  TimeStamps times() const override {
    TimeStamps out{.fps = fps_, .pts_s = {}};
    for (std::size_t k = 0; k < index_; ++k) out.pts_s.push_back(static_cast<double>(k) / fps_);
    return out;
  }

  std::vector<std::string> warnings() const override { return {}; }
  std::string description() const override {
    return fmt::format("stills ({}), {} bit", files_[0].extension().string(), bits_);
  }

 private:
  std::vector<fs::path> files_;
  double fps_;
  std::size_t index_ = 0;
  int bits_ = 8;
  cv::Size size_;
};

}  // namespace

cv::Mat read_still(const fs::path& file) {
  if (!fs::exists(file)) fail(file, "does not exist");
  if (fs::file_size(file) == 0) fail(file, "is empty (0 bytes), expected a picture");
  cv::Mat bgr = is_exr(file) ? read_exr_still(file) : cv::imread(file.string(), cv::IMREAD_COLOR | cv::IMREAD_ANYDEPTH);
  if (bgr.depth() == CV_32F) bgr = srgb16_from_linear(bgr);
  if (bgr.empty()) fail(file, "is not a picture that OpenCV can read");
  if (std::min(bgr.cols, bgr.rows) < kMinSidePx)
    fail(file, fmt::format("is {}x{} px, expected at least {}x{}", bgr.cols, bgr.rows, kMinSidePx, kMinSidePx));
  return bgr;
}

std::unique_ptr<Footage> open_stills(std::vector<fs::path> files, std::optional<double> declared_fps) {
  return std::make_unique<Stills>(std::move(files), declared_fps.value_or(kDefaultStillsFps));
}

}  // namespace vantage
