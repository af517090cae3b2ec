#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "jobs/ingest/footage.h"
#include "jobs/ingest/video_facts.h"
#include "jobs/ingest/video_pictures.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

class Video : public Footage {
 public:
  Video(const fs::path& file, const fs::path& scratch)
      : file_(file), facts_(read_video_facts(file, scratch)), pictures_(file, facts_, scratch) {}

  cv::Mat next() override {
    cv::Mat bgr = pictures_.next();
    if (bgr.empty()) {
      if (told_s_.empty()) fail("is a video without a readable frame");
      return {};
    }
    if (size_.empty()) size_ = bgr.size();
    if (bgr.size() != size_)
      fail(fmt::format("picture {} is {}x{} px, expected {}x{} as those before it", told_s_.size(), bgr.cols, bgr.rows,
                       size_.width, size_.height));
    if (std::min(bgr.cols, bgr.rows) < kMinSidePx)
      fail(fmt::format("is {}x{} px, expected at least {}x{}", bgr.cols, bgr.rows, kMinSidePx, kMinSidePx));
    told_s_.push_back(pictures_.time_s());
    if (told_s_.size() > 1) last_time_s_ = std::max(last_time_s_, since_first_s());
    return bgr;
  }

  int num_promised() const override { return facts_.num_promised; }
  double last_time_s() const override { return last_time_s_; }
  TimeStamps times() const override { return time_stamps(told_s_, facts_.fps); }

  /// Both fewer frames and less time than promised: the count of some containers is only time × rate.
  bool is_truncated() const override {
    const int num = static_cast<int>(told_s_.size()), promised = facts_.num_promised;
    const double covered_s = std::max(times().pts_s.back(), num / facts_.fps);
    return num + 1 < promised && covered_s + 2 / facts_.fps < promised / facts_.fps;
  }

  double start_on_files_clock_s() const override { return told_s_.empty() ? 0 : told_s_.front().value_or(0); }

  std::vector<std::string> warnings() const override {
    auto out = facts_.warnings();
    if (pictures_.num_damaged() > 0)
      out.push_back(
          fmt::format("footage is damaged: ffmpeg could not decode {} places, pictures there may be missing or "
                      "spoilt",
                      pictures_.num_damaged()));
    return out;
  }
  std::string description() const override {
    return fmt::format("{}, {} bit, matrix {}{}", facts_.codec, facts_.bits, facts_.matrix_used(),
                       facts_.matrix.empty() ? " (assumed)" : "");
  }

 private:
  double since_first_s() const {
    if (told_s_.front() && told_s_.back()) return *told_s_.back() - *told_s_.front();
    return last_time_s_ + 1 / facts_.fps;
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorKind::BadInput, fmt::format("{}: {}", file_.string(), what));
  }

  fs::path file_;
  VideoFacts facts_;
  VideoPictures pictures_;
  cv::Size size_;
  std::vector<std::optional<double>> told_s_;
  double last_time_s_ = 0;
};

}  // namespace

std::unique_ptr<Footage> open_video(const fs::path& file, const fs::path& scratch) {
  return std::make_unique<Video>(file, scratch);
}

}  // namespace vantage
