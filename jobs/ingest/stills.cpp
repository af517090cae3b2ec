#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
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

bool is_exr(const fs::path& file) {
  const std::string suffix = file.extension().string();
  return suffix == ".exr" || suffix == ".EXR";
}

/// Of a PNG from its header (PNG 1.2, §11.2.2: the byte behind width and height), of a TIFF from the picture as it is;
/// the others have 8, EXR is meant to lose its range.
int bits_of(const fs::path& file) {
  std::array<unsigned char, 25> head{};
  std::ifstream(file, std::ios::binary).read(reinterpret_cast<char*>(head.data()), head.size());
  if (head[1] == 'P' && head[2] == 'N' && head[3] == 'G') return head[24];
  const bool is_tiff = (head[0] == 'I' && head[1] == 'I') || (head[0] == 'M' && head[1] == 'M');
  if (!is_tiff) return 8;
  return static_cast<int>(8 * cv::imread(file.string(), cv::IMREAD_UNCHANGED).elemSize1());
}

class Stills : public Footage {
 public:
  Stills(std::vector<fs::path> files, double fps) : files_(std::move(files)), fps_(fps) {}

  cv::Mat next() override {
    if (index_ == files_.size()) return {};
    const fs::path& file = files_[index_++];
    cv::Mat bgr = read_still(file);
    max_bits_ = std::max(max_bits_, bits_of(file));
    if (size_.empty()) size_ = bgr.size();
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

  std::vector<std::string> warnings() const override {
    if (max_bits_ <= 8) return {};
    return {fmt::format("footage has {} bits per channel: pictures are kept with 8", max_bits_)};
  }
  std::string description() const override {
    return fmt::format("stills ({}), {} bit", files_[0].extension().string(), max_bits_);
  }

 private:
  std::vector<fs::path> files_;
  double fps_;
  std::size_t index_ = 0;
  int max_bits_ = 8;
  cv::Size size_;
};

}  // namespace

cv::Mat read_still(const fs::path& file) {
  if (!fs::exists(file)) fail(file, "does not exist");
  if (fs::file_size(file) == 0) fail(file, "is empty (0 bytes), expected a picture");
  cv::Mat bgr = is_exr(file) ? read_exr_still(file) : cv::imread(file.string(), cv::IMREAD_COLOR);
  if (bgr.empty()) fail(file, "is not a picture that OpenCV can read");
  if (std::min(bgr.cols, bgr.rows) < kMinSidePx)
    fail(file, fmt::format("is {}x{} px, expected at least {}x{}", bgr.cols, bgr.rows, kMinSidePx, kMinSidePx));
  return bgr;
}

std::unique_ptr<Footage> open_stills(std::vector<fs::path> files, std::optional<double> declared_fps) {
  return std::make_unique<Stills>(std::move(files), declared_fps.value_or(kDefaultStillsFps));
}

}  // namespace vantage
