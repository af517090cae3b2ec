#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "jobs/ingest/footage.h"
#include "schema/base/error.h"
#include "schema/formats/exr.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(const fs::path& file, const std::string& what) {
  throw Error(ErrorKind::BadInput, fmt::format("{}: {}", file.string(), what));
}

/// IEC 61966-2-1.
uchar srgb_of_linear(float linear) {
  const float v = std::clamp(linear, 0.0F, 1.0F);
  const float encoded = v <= 0.0031308F ? 12.92F * v : 1.055F * std::pow(v, 1 / 2.4F) - 0.055F;
  return static_cast<uchar>(std::lround(255 * encoded));
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
  cv::Mat out(bgr[0]->height, bgr[0]->width, CV_8UC3);
  for (std::size_t i = 0; i < out.total(); ++i)
    for (int c = 0; c < 3; ++c)
      out.ptr<cv::Vec3b>()[i][c] = srgb_of_linear(bgr[static_cast<std::size_t>(c)]->values[i]);
  return out;
}

class Stills : public Footage {
 public:
  Stills(std::vector<fs::path> files, double fps) : files_(std::move(files)), fps_(fps) {}

  cv::Mat next() override {
    if (index_ == files_.size()) return {};
    const fs::path& file = files_[index_++];
    cv::Mat bgr = read_still(file);
    if (size_.empty()) size_ = bgr.size();
    if (bgr.size() != size_)
      fail(file, fmt::format("is {}x{} px, expected {}x{} px as the pictures before it", bgr.cols, bgr.rows,
                             size_.width, size_.height));
    return bgr;
  }

  int num_promised() const override { return static_cast<int>(files_.size()); }
  bool is_truncated() const override { return false; }

  TimeStamps times(const fs::path&) const override {
    TimeStamps out{.fps = fps_, .pts_s = {}};
    for (std::size_t k = 0; k < files_.size(); ++k) out.pts_s.push_back(static_cast<double>(k) / fps_);
    return out;
  }

 private:
  std::vector<fs::path> files_;
  double fps_;
  std::size_t index_ = 0;
  cv::Size size_;
};

}  // namespace

cv::Mat read_still(const fs::path& file) {
  if (!fs::exists(file)) fail(file, "does not exist");
  cv::Mat bgr = file.extension() == ".exr" ? read_exr_still(file) : cv::imread(file.string(), cv::IMREAD_COLOR);
  if (bgr.empty()) fail(file, "is not a picture that OpenCV can read");
  if (std::min(bgr.cols, bgr.rows) < kMinSidePx)
    fail(file, fmt::format("is {}x{} px, expected at least {}x{}", bgr.cols, bgr.rows, kMinSidePx, kMinSidePx));
  return bgr;
}

std::unique_ptr<Footage> open_stills(std::vector<fs::path> files, std::optional<double> declared_fps) {
  return std::make_unique<Stills>(std::move(files), declared_fps.value_or(kDefaultStillsFps));
}

}  // namespace vantage
