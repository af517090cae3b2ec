#pragma once
#include <string>
#include <vector>

#include "jobs/views/disparity_curve.h"
#include "schema/shot/params.h"
#include "schema/shot/shot.h"

namespace vantage {

/// The keys of a [[render]] besides name, mode, size, fps and path.
struct RenderOptions {
  std::string method = "auto";    ///< how pixels find their place in the view
  std::string outside = "clamp";  ///< what becomes of views outside the recording hull
  double eye_azimuth_deg = 1.5;
  double baseline = 0;
  double baseline_percent = 0, baseline_percent_at = 0;
  double convergence = 0;
  std::string disparity_map = "linear";
  double disparity_gain = 1;
  double disparity_offset_px = 0;
  std::vector<std::string> disparity_points;
  double histogram_strength = 0.7;
  /// Sky's rules for stereoscopic programmes ("BSkyB Technical Guidelines for Plano Stereoscopic (3D) Programme
  /// Content", 2010), which other broadcasters took over: 1 % in front of the screen, 2 % behind it.
  double crossed_percent = 1, uncrossed_percent = 2;
  double floating_window_percent = 0;
  std::string matte = "none";
  std::string over;

  /// The frames' alpha is the foreground's.
  bool is_see_through() const { return matte != "none" && over.empty(); }

  void fields(auto&& field) {
    field("method", method, OneOf{{"auto", "correspondence", "depth", "plain"}},
          "auto: by depth where it is known, else by correspondences; or only one of the two; plain: the paper's "
          "Eq. 6 in pixels, without any depth");
    field("outside", outside, OneOf{{"clamp", "refuse"}},
          "a view outside the recording hull: clamp draws it from the nearest images, refuse is an error");
    field("eye_azimuth_deg", eye_azimuth_deg, Range{0.01, 30},
          "stereo: azimuth between the eyes, as seen from the scene's centre");
    field("baseline", baseline, Range{0, 1e9},
          "stereo: distance of the eyes in world units; 0: from baseline_percent, views.json or eye_azimuth_deg");
    field(
        "baseline_percent", baseline_percent, Range{0, 50},
        "stereo: as large a baseline as gives points at baseline_percent_at this disparity, % of the width; 0: unused");
    field("baseline_percent_at", baseline_percent_at, Range{0, 1e12},
          "stereo: distance that baseline_percent is meant for, world units; 0: infinity");
    field("convergence", convergence, Range{0, 1e12},
          "stereo: distance without disparity, world units; 0: the scene's centre (key frames), infinity (views.json)");
    field(
        "disparity_map", disparity_map, OneOf{{"linear", "fit", "log", "piecewise", "histogram"}},
        "stereo-depth: linear: by disparity_gain and disparity_offset_px; piecewise: through disparity_points; into "
        "the depth budget: fit, a line; log, natural at the screen and ever flatter away from it; histogram, more room "
        "for what fills more of the picture");
    field("disparity_gain", disparity_gain, Range{0, 10}, "linear: disparity is multiplied by this");
    field("disparity_offset_px", disparity_offset_px, Range{-1000, 1000},
          "linear: then this is added; positive brings everything towards the viewer");
    field("disparity_points", disparity_points, Any{},
          "piecewise: \"from:to\" in % of the width, rising; positive lies behind the screen, negative in front");
    field("histogram_strength", histogram_strength, Range{0, 1}, "histogram: 0 a line, 1 the histogram alone");
    field("crossed_percent", crossed_percent, Range{0, 25},
          "stereo: depth budget in front of the screen, % of the width");
    field("uncrossed_percent", uncrossed_percent, Range{0, 25},
          "stereo: depth budget behind the screen, % of the width");
    field(
        "floating_window_percent", floating_window_percent, Range{0, 10},
        "stereo: black bars, left in the left eye and right in the right one, that bring the picture's frame this far "
        "in front of the screen, % of the width");
    field(
        "matte", matte, OneOf{{"none", "key", "mask"}},
        "what of each image is foreground, the rest is see-through: key: what is not the camera's key_color; mask: its "
        "mask, with its greys");
    field(
        "over", over, Any{},
        "with a matte: what the foreground stands in front of or in: a folder of frames rendered for the same cameras "
        "(frame.000000.exr …), e.g. of the empty set, relative to shot.toml");
  }
};

/// Throws Error(BadInput) with file and line for an unknown key or a bad value.
RenderOptions render_options(const RenderRequest& request);

/// How the request maps disparity in pictures of this width. Throws Error(BadInput) like render_options.
DisparityMapping disparity_mapping(const RenderRequest& request, int width_px);

}  // namespace vantage
