#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "schema/shot/section.h"

namespace vantage {

/// One [[camera]] of shot.toml.
struct ShotCamera {
  std::string name;           ///< letters, digits, '_' and '-'; unique
  std::string footage;        ///< video file, or a glob of stills, relative to shot.toml
  std::optional<double> fps;  ///< needed for stills (default 1); of a video with a constant rate it replaces that rate
  std::optional<double> start_s;     ///< shot time of the first frame; needed with [sync] method = "known"
  bool moving = false;               ///< hand-held: a pose per frame
  double trim_start_s = 0;           ///< footage before this time (from its first frame) is not used
  std::optional<double> trim_end_s;  ///< nor footage from this time on
  double readout_ms = 0;  ///< rolling shutter: time from the first row's exposure to the last one's; 0: global
  std::string mask, key_color, calibration;
  int line = 0;
};

/// A point of a virtual camera's path; values between key frames are interpolated.
struct KeyFrame {
  double at_s = 0;         ///< time in the output
  double time_s = 0;       ///< time in the shot
  double azimuth_deg = 0;  ///< on the navigation sphere
  double elevation_deg = 0;
};

/// One [[render]].
struct RenderRequest {
  std::string name;
  std::string mode = "view";  ///< "view", "stereo" (azimuth offset or explicit baseline), "stereo-depth"
  double fps = 30;
  int width = 0, height = 0;        ///< 0: as the footage of the first camera
  std::vector<KeyFrame> keyframes;  ///< either these, in order of at_s,
  std::string views;                ///< or a views.json, relative to shot.toml
  Section options;                  ///< all other keys: the render kind's own options
  int line = 0;
};

/// shot.toml, checked as far as it can be without opening footage.
struct Shot {
  std::filesystem::path folder;  ///< absolute
  std::string name;
  std::vector<ShotCamera> cameras;
  std::map<std::string, Section> sections;  ///< by job kind; absent ones are not in the map
  std::vector<RenderRequest> renders;

  /// The table of a kind, or an empty one (present() false) when shot.toml has none.
  Section section(const std::string& kind) const;
  bool has_section(const std::string& kind) const { return sections.contains(kind); }
  /// Text value of a key of a section, or the fallback when absent.
  std::string text(const std::string& kind, const std::string& key, const std::string& fallback) const;
  const ShotCamera& camera(const std::string& name) const;  ///< throws Error(Bug) when there is none
};

/// Reads FOLDER/shot.toml. section_names: the kinds' names, i.e. the tables that may stand there.
/// Throws Error(BadInput): no such folder or file; TOML error with line and column; unknown table or key with a
/// suggestion; duplicate or bad names; fewer than two cameras; bad key frames.
Shot read_shot(const std::filesystem::path& folder, const std::vector<std::string>& section_names);

}  // namespace vantage
