#pragma once
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "jobs/calibrate/colmap.h"
#include "jobs/calibrate/known.h"

namespace vantage {

/// A frame of one of the shot's cameras as 8-bit BGR.
using FrameReader = std::function<cv::Mat(const ImageId&)>;

/// Pictures that calibration works on: one plate (plate.h) of every static camera, as its frame 0, and key frames of
/// every moving one.
struct Survey {
  struct Picture {
    ImageId image;
    double position = 0;  ///< in the footage, 0 to 1
    bool moving = false;
    std::string name() const;  ///< "cam0/000003.png"
  };
  std::vector<Picture> pictures;  ///< by camera, then frame

  /// Pairs worth matching: all of a few pictures. Of many: static with everything; within a moving camera each key
  /// frame with the next five; between moving ones the three nearest in position, which supposes that they were filmed
  /// at about the same time.
  std::vector<PicturePair> pairs() const;
};

/// Writes the pictures as <folder>/<camera>/<frame:06d>.png.
Survey write_survey(const std::filesystem::path& folder, const std::vector<FilmedCamera>& cameras,
                    const FrameReader& read, int plate_frames, int max_key_frames);

/// Matching features of the two pictures that have most in common, checked by epipolar geometry. For messages.
struct BestPair {
  std::string a, b;
  int num_matches = 0;
};
BestPair best_pair(const std::filesystem::path& folder, const Survey& survey);

}  // namespace vantage
