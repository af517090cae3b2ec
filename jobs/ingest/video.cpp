#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/videoio.hpp>

#include "jobs/ingest/footage.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

class Video : public Footage {
 public:
  explicit Video(const fs::path& file) : file_(file) {
    if (!fs::exists(file)) fail("does not exist");
    // Only FFmpeg: OpenCV's other back ends keep no time stamps.
    if (!capture_.open(fs::absolute(file).string(), cv::CAP_FFMPEG)) fail("is not a video that FFmpeg can read");
    const double fps = capture_.get(cv::CAP_PROP_FPS), count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
    fps_ = std::isfinite(fps) && fps > 0.01 && fps < 10000 ? fps : 30;
    num_promised_ = std::isfinite(count) && count > 0 && count < 1e8 ? static_cast<int>(count) : 0;
  }

  cv::Mat next() override {
    cv::Mat bgr;
    if (!capture_.read(bgr)) {
      if (decoder_s_.empty()) fail("is a video without a readable frame");
      return {};
    }
    if (std::min(bgr.cols, bgr.rows) < kMinSidePx)
      fail(fmt::format("is {}x{} px, expected at least {}x{}", bgr.cols, bgr.rows, kMinSidePx, kMinSidePx));
    decoder_s_.push_back(capture_.get(cv::CAP_PROP_POS_MSEC) / 1000);
    return bgr;
  }

  int num_promised() const override { return num_promised_; }

  TimeStamps times(const fs::path& scratch) const override {
    return time_stamps(decoder_s_, packet_times_s(file_, scratch), fps_);
  }

  /// Both fewer frames and less time than promised: the count of some containers is only time × rate.
  bool is_truncated() const override {
    const double last_s = *std::max_element(decoder_s_.begin(), decoder_s_.end());
    const double covered_s = std::max(last_s, static_cast<double>(decoder_s_.size()) / fps_);
    return static_cast<int>(decoder_s_.size()) + 1 < num_promised_ && covered_s + 2 / fps_ < num_promised_ / fps_;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorKind::BadInput, fmt::format("{}: {}", file_.string(), what));
  }

  fs::path file_;
  cv::VideoCapture capture_;
  double fps_ = 0;
  int num_promised_ = 0;
  std::vector<double> decoder_s_;
};

}  // namespace

std::unique_ptr<Footage> open_video(const fs::path& file) { return std::make_unique<Video>(file); }

}  // namespace vantage
