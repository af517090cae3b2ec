#pragma once
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <string>

namespace vantage {

struct FilmOptions {
  double fps = 30;
  std::string codec = "h264";  ///< "h264", or "prores": ProRes 422 HQ, 10 bit, for editors
  int bits = 8;                ///< h264: 8 or 10 (High 10 profile) a channel
  int crf = 18;
  std::string preset = "medium";
  int frame_packing = 0;  ///< H.264's code for two eyes in a picture: 3 side by side, 4 one above the other; 0: one eye
};

/// Film of count pictures, through the ffmpeg program, one thread and no time stamps: same bytes for same pictures.
/// Each picture goes there as it is made: nothing is kept. Colours are tagged: Rec. 709 primaries and matrix, sRGB
/// transfer, video range. Odd sizes are padded by a black row or column. picture(k): 8- or 16-bit sRGB BGR, all of one
/// size and depth. file: .mp4, or .mov for prores. log: ffmpeg's words. Throws Error(BadInput) when there are none or
/// their sizes differ, Error(Resource) with ffmpeg's last words when it fails.
void write_film(const std::filesystem::path& file, std::size_t count,
                const std::function<cv::Mat(std::size_t)>& picture, const FilmOptions& options,
                const std::filesystem::path& log);

}  // namespace vantage
