#pragma once
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <string>

#include "jobs/job_context.h"
#include "schema/formats/frame_table.h"

namespace vantage {

/// Which pixels of a camera's footage count: a person's `mask`, one still for all frames or one picture per frame. In
/// the footage's own pixels (as filmed, upright), 255 where a pixel counts, 0 where it is to be ignored (the mask is
/// darker than half there).
class CameraMask {
 public:
  /// No mask: everything counts.
  CameraMask() = default;
  /// The camera's "mask/<camera>…" sources among the job's, if any (jobs/mask_sources.h); reads its "ingest/<camera>".
  CameraMask(const JobContext& context, const FrameTable& table);

  bool exists() const { return !still_.empty() || !files_.empty(); }
  /// Empty without a mask. Throws Error(BadInput) naming camera and file: unreadable, of another size, none for that
  /// frame.
  cv::Mat1b at(int frame) const;
  /// The same with its greys, 0–255: for compositing.
  cv::Mat1b matte_at(int frame) const;
  /// What a plate (the median of those frames) shows: counts where more than half of the frames count.
  cv::Mat1b of_plate(const std::vector<int>& frames) const;

 private:
  const std::filesystem::path& file_at(int frame) const;
  cv::Mat1b read(const std::filesystem::path& file) const;

  std::string camera_;
  cv::Size size_;
  int num_before_ = 0;  ///< pictures trimmed off the start
  std::filesystem::path still_file_;
  cv::Mat1b still_;
  std::map<int, std::filesystem::path> files_;  ///< by index in the whole footage
};

}  // namespace vantage
