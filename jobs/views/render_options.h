#pragma once
#include <string>

#include "schema/shot/params.h"
#include "schema/shot/shot.h"

namespace vantage {

/// The keys of a [[render]] besides name, mode, size, fps and path.
struct RenderOptions {
  std::string method = "auto";  ///< how pixels find their place in the view
  double eye_azimuth_deg = 1.5;
  double baseline = 0;
  double convergence = 0;
  double disparity_gain = 1;
  double disparity_offset_px = 0;

  void fields(auto&& field) {
    field("method", method, OneOf{{"auto", "correspondence", "depth"}},
          "auto: by depth where it is known, else by correspondences; or only one of the two");
    field("eye_azimuth_deg", eye_azimuth_deg, Range{0.01, 30}, "stereo along key frames: azimuth between the eyes");
    field("baseline", baseline, Range{0, 1e9},
          "stereo: distance of the eyes in world units; 0: from eye_azimuth_deg or views.json");
    field("convergence", convergence, Range{0, 1e12},
          "stereo: distance without disparity, world units; 0: the scene's centre (key frames), infinity (views.json)");
    field("disparity_gain", disparity_gain, Range{-10, 10}, "stereo-depth: disparity is multiplied by this");
    field("disparity_offset_px", disparity_offset_px, Range{-1000, 1000}, "stereo-depth: then this is added");
  }
};

/// Throws Error(BadInput) with file and line for an unknown key or a bad value.
inline RenderOptions render_options(const RenderRequest& request) {
  return params_from_section<RenderOptions>(request.options);
}

}  // namespace vantage
