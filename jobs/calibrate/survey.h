#pragma once
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "jobs/calibrate/features.h"
#include "jobs/calibrate/known.h"

namespace vantage {

/// A frame of one of the shot's cameras as 8-bit BGR.
using FrameReader = std::function<cv::Mat(const ImageId&)>;

/// Which pixels of a camera's frames, or of their median, count: 255; 0 where a person's mask says no. Empty: all.
using MaskReader = std::function<cv::Mat(const std::string& camera, const std::vector<int>& frames)>;

struct Footage {
  FrameReader frame;
  MaskReader counts;
};

struct SurveyOptions {
  FeatureOptions features;
  int plate_frames = 31;    ///< of a static camera, for its background
  int max_key_frames = 30;  ///< of a moving camera
  int max_moments = 24;     ///< at which moving things are looked at, when clocks are known
};

/// What calibration works on. All that a static camera sees it sees from one place, so its pictures count as one, frame
/// 0: the background of the whole footage and, when clocks are known, what moves at several moments. Of a moving
/// camera: key frames, each a picture.
struct Survey {
  /// Features of one picture that may be matched with those of the same moment in others.
  struct Glimpse {
    int moment = kBackground;
    std::optional<int> frame;  ///< of the footage; empty: a static camera's background
    Features features;         ///< where they are at the moment: moving ones are carried there from the frame
    std::vector<Eigen::Vector2d> carried_px;  ///< by how much; empty: not at all
  };
  static constexpr int kBackground = -1;  ///< the moment of what does not move

  struct Picture {
    ImageId image;
    int width = 0, height = 0;
    double position = 0;  ///< in the footage, 0 to 1
    bool moving = false;  ///< its camera
    std::vector<Glimpse> glimpses;
    std::string name() const;  ///< "cam0/000003.png"
    /// Features are numbered through all glimpses.
    std::size_t num_features() const;
  };
  std::vector<Picture> pictures;  ///< by camera, then frame

  /// Pairs worth matching, as indices: all of a few pictures. Of many: static with everything; within a moving camera
  /// each key frame with the next five; between moving ones the three nearest in position, which supposes that they
  /// were filmed at about the same time.
  std::vector<std::pair<int, int>> pairs() const;
};

/// on_progress: 0 to 1.
Survey take_survey(const std::vector<FilmedCamera>& cameras, const Footage& footage, const SurveyOptions& options,
                   const std::function<void(double)>& on_progress);

}  // namespace vantage
