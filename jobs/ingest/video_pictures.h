#pragma once
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "jobs/ingest/video_facts.h"

namespace vantage {

/// Pictures of a video as ffmpeg decodes them, in order of presentation, none dropped and none repeated: upright,
/// pixels square, deinterlaced where interlaced, converted with the footage's own matrix and range (OpenCV's reader
/// takes BT.601, limited, for everything). Damaged ones as ffmpeg conceals them.
class VideoPictures {
 public:
  /// scratch: a folder for ffmpeg's messages.
  VideoPictures(const std::filesystem::path& video, const VideoFacts& facts, const std::filesystem::path& scratch);
  ~VideoPictures();

  /// BGR, 8-bit, or 16-bit of deeper footage; empty at the end, and where ffmpeg gives up.
  cv::Mat next();
  /// Presentation time of the picture that next() gave last, on the file's clock; empty when the file does not say.
  std::optional<double> time_s() const { return time_s_; }
  /// Places that ffmpeg could not decode so far.
  int num_damaged() const { return num_damaged_; }

 private:
  class Messages;
  struct Pipe;

  std::unique_ptr<Messages> messages_;
  std::unique_ptr<Pipe> pipe_;
  std::optional<double> time_s_;
  int num_damaged_ = 0;
};

}  // namespace vantage
