#include "jobs/vision/camera_mask.h"

#include <fmt/format.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "schema/base/error.h"
#include "schema/formats/footage_trim.h"

namespace vantage {
namespace fs = std::filesystem;

namespace {

cv::Mat1b counting(const cv::Mat1b& greys) {
  const cv::Mat counts = greys > 127;
  return counts;
}

}  // namespace

CameraMask::CameraMask(const JobContext& context, const FrameTable& table)
    : camera_(table.camera), size_(table.width, table.height) {
  const std::string still = "mask/" + camera_, sequence = still + "/";
  if (context.sources().contains(still)) {
    still_file_ = context.source(still);
    still_ = counting(read(still_file_));
  }
  for (const auto& [name, path] : context.sources())
    if (name.starts_with(sequence)) files_[std::stoi(name.substr(sequence.size()))] = path;
  if (!files_.empty()) num_before_ = read_footage_trim(context.input("ingest/" + camera_)).num_before;
}

const fs::path& CameraMask::file_at(int frame) const {
  if (!still_file_.empty()) return still_file_;
  const auto found = files_.find(frame + num_before_);
  if (found == files_.end())
    throw Error(
        ErrorKind::BadInput,
        fmt::format("camera '{}': its mask has no picture number {}, its footage has; expected one mask, or one "
                    "per picture of the footage",
                    camera_, frame + num_before_));
  return found->second;
}

cv::Mat1b CameraMask::at(int frame) const {
  return !exists() || !still_.empty() ? still_ : counting(read(file_at(frame)));
}

cv::Mat1b CameraMask::matte_at(int frame) const { return exists() ? read(file_at(frame)) : cv::Mat1b(); }

cv::Mat1b CameraMask::of_plate(const std::vector<int>& frames) const {
  if (!exists() || !still_.empty()) return still_;
  cv::Mat1w num_counting(size_, ushort{0});
  for (const int frame : frames) cv::add(num_counting, 1, num_counting, at(frame));
  const cv::Mat counts = num_counting > static_cast<double>(frames.size()) / 2;
  return counts;
}

cv::Mat1b CameraMask::read(const fs::path& file) const {
  const cv::Mat1b mask = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  const auto fail = [&](const std::string& what) {
    throw Error(ErrorKind::BadInput, fmt::format("{}: mask of camera '{}': {}", file.string(), camera_, what));
  };
  if (mask.empty()) fail("is not a picture that OpenCV can read");
  if (mask.size() != size_)
    fail(fmt::format("is {}x{} px, expected {}x{} as its footage", mask.cols, mask.rows, size_.width, size_.height));
  return mask;
}

}  // namespace vantage
