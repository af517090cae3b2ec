#pragma once
/// Foreground cut out of its surroundings, and put in front of others: all colours premultiplied by alpha (Porter &
/// Duff 1984).
#include "jobs/job_context.h"
#include "jobs/render/blend.h"
#include "jobs/render/source_image.h"
#include "jobs/vision/shot_images.h"

namespace vantage {

/// Gives an image the matte that the job's unit asks for, if any: "matte": {"kind": "key" or "mask", "keys": {camera:
/// "#rrggbb"}}.
void cut_out(const JobContext& context, ShotImages& shot, SourceImage& image);

/// The foreground over a background of its size, by depth: what of the background is nearer (by 1 to 4 % of depth)
/// hides it. Where either depth is unknown, the foreground is in front.
ViewPicture put_over(const ViewPicture& foreground, const ViewPicture& background);

/// A view ("", "left", "right") of a frame.exr. Throws Error(BadInput) when it is not of that size.
ViewPicture read_rendered(const std::filesystem::path& exr, const std::string& view, cv::Size size);

}  // namespace vantage
