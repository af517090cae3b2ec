#pragma once
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "jobs/ingest/time_stamps.h"

namespace vantage {

/// Pictures of one camera in order of presentation, read one after the other.
class Footage {
 public:
  virtual ~Footage() = default;
  /// BGR of 8 bits, or 16 of deeper footage; upright, pixels square; empty at the end. All are of one size, at least
  /// kMinSidePx. Throws Error(BadInput) naming the file.
  virtual cv::Mat next() = 0;
  /// Number of frames that the file says it has; may be wrong, 0 when it does not say.
  virtual int num_promised() const = 0;
  /// Time of the picture that next() gave last since the first one; never falls.
  virtual double last_time_s() const = 0;
  /// Of the pictures that next() has given so far; one at least.
  virtual TimeStamps times() const = 0;
  /// The last picture is well before the end that the file promises. Once next() has come to the end.
  virtual bool is_truncated() const = 0;
  /// When the first picture is shown, on the clock that the file's sound has, too. Once next() has given one.
  virtual double start_on_files_clock_s() const = 0;
  /// Sentences on what was done to the pictures and what is lost. Once next() has come to the end.
  virtual std::vector<std::string> warnings() const = 0;
  /// "h264, 8 bit, matrix bt709"
  virtual std::string description() const = 0;
};

constexpr int kMinSidePx = 64;
constexpr double kDefaultStillsFps = 1;

/// declared_fps: time of stills; video is told by its time stamps, see declare_fps(). scratch: a folder for temporary
/// files. Throws Error(BadInput): not there, not a video, not a picture, too small, stills of different sizes.
std::unique_ptr<Footage> open_stills(std::vector<std::filesystem::path> files, std::optional<double> declared_fps);
std::unique_ptr<Footage> open_video(const std::filesystem::path& file, const std::filesystem::path& scratch);

/// One still as BGR of 8 or 16 bits. EXR and floating-point TIFF are linear light and become sRGB of 16 bits, brighter
/// than 1 is clipped. Throws Error(BadInput).
cv::Mat read_still(const std::filesystem::path& file);

}  // namespace vantage
