#include "jobs/render/render_view.h"

#include "jobs/render/pixel_places.h"
#include "jobs/render/splat.h"
#include "schema/base/error.h"

namespace vantage {

ViewPicture render_eye(std::span<const SourceImage> images, const FramePlan& plan, const PlannedEye& eye) {
  check(images.size() == plan.images.size() && !images.empty(), "a view is drawn from its planned images");
  const ViewCamera view{eye.pinhole, eye.cam_from_world, eye.disparity};
  const PlacingOptions placing{plan.method, plan.time_s, plan.scene_distance, eye.mu};
  std::vector<ColouredLayer> layers;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const SourceImage& image = images[i];
    // The scene's centre is about as far from the recorded cameras as from the virtual one: they share a sphere.
    const double scale = eye.pinhole.fx / image.pinhole.fx;
    ColouredLayer coloured;
    coloured.layer = splat(place_pixels(images, static_cast<int>(i), placing), view, scale);
    coloured.bgr = layer_colours(image.bgr, coloured.layer);
    coloured.share = eye.share[i];
    layers.push_back(std::move(coloured));
  }
  return blend(layers);
}

}  // namespace vantage
