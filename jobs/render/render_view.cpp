#include "jobs/render/render_view.h"

#include "jobs/render/camera_paint.h"
#include "jobs/render/fill_holes.h"
#include "jobs/render/forward_motion.h"
#include "jobs/render/pixel_places.h"
#include "jobs/render/splat.h"
#include "schema/base/error.h"

namespace vantage {

ViewPicture render_eye(std::span<const SourceImage> images, const FramePlan& plan, const PlannedEye& eye) {
  check(images.size() == plan.images.size() && !images.empty(), "a view is drawn from its planned images");
  const ViewCamera view{eye.pinhole, eye.cam_from_world, eye.disparity};
  const PlacingOptions placing{plan.method, plan.time_s, plan.scene_distance, eye.mu};
  std::vector<PictureLayer> layers(images.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(images.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      // The scene's centre is about as far from the recorded cameras as from the virtual one: they share a sphere.
      const double scale = eye.pinhole.fx / images[k].pinhole.fx;
      const PixelPlaces places(images, i, view, placing);
      layers[k] = {splat(places, {eye.pinhole.width, eye.pinhole.height}, scale), images[k].bgr,
                   static_cast<float>(eye.share[k]), camera_paint(images, k), images[k].alpha};
    }
  });
  ViewPicture picture = blend(layers);
  if (eye.next && plan.method != "plain") {
    const ViewCamera next{eye.next->pinhole, eye.next->cam_from_world, eye.disparity};
    PlacingOptions at_next = placing;
    at_next.time_s = eye.next->time_s;
    picture.forward = forward_motion(images, layers, picture.strongest, view, placing, next, at_next);
  }
  if (images.front().alpha.empty()) fill_holes(picture);  // else what is unknown is see-through
  return picture;
}

}  // namespace vantage
