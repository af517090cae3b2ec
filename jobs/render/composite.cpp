#include "jobs/render/composite.h"

#include <fmt/format.h>

#include <algorithm>

#include "jobs/views/hex_colour.h"
#include "jobs/vision/chroma_key.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr float kSame = 0.01F, kHidden = 0.04F;  ///< of depth

/// 1 where the foreground is seen, 0 where the background is in front of it.
float seen(float foreground_z, float background_z) {
  if (foreground_z <= 0 || background_z <= 0) return 1;
  const float t = std::clamp((foreground_z / background_z - 1 - kSame) / (kHidden - kSame), 0.0F, 1.0F);
  return 1 - t * t * (3 - 2 * t);
}

}  // namespace

void cut_out(const JobContext& context, ShotImages& shot, SourceImage& image) {
  if (!context.unit().contains("matte")) return;
  const Json& matte = context.unit().at("matte");
  if (matte.at("kind") == "mask") {
    image.alpha = shot.matte(image.id);
    for (int y = 0; y < image.bgr.rows; ++y)
      for (int x = 0; x < image.bgr.cols; ++x) image.bgr(y, x) *= image.alpha(y, x);
    return;
  }
  const auto rgb = rgb_from_hex(matte.at("keys").at(image.id.camera), "key_color of camera '" + image.id.camera + "'");
  KeyedPicture keyed = chroma_key(image.bgr, shot.linear_colour(image.id.camera, {rgb[2], rgb[1], rgb[0]}));
  image.bgr = keyed.bgr;
  image.alpha = keyed.alpha;
}

ViewPicture put_over(const ViewPicture& foreground, const ViewPicture& background) {
  ViewPicture out{background.bgr.clone(), background.alpha.clone(), background.z.clone(), background.hole.clone(),
                  foreground.paint};
  for (int y = 0; y < out.bgr.rows; ++y)
    for (int x = 0; x < out.bgr.cols; ++x) {
      const float visible = seen(foreground.z(y, x), background.z(y, x)), cover = visible * foreground.alpha(y, x);
      out.bgr(y, x) = visible * foreground.bgr(y, x) + (1 - cover) * background.bgr(y, x);
      out.alpha(y, x) = cover + (1 - cover) * background.alpha(y, x);
      out.hole(y, x) = cover * foreground.hole(y, x) + (1 - cover) * background.hole(y, x);
      if (cover > 0.5F) out.z(y, x) = foreground.z(y, x);
    }
  return out;
}

ViewPicture read_rendered(const std::filesystem::path& exr, const std::string& view, cv::Size size) {
  const Channels channels = read_exr(exr, view);
  const auto plane = [&](const char* name, float fallback) {
    const auto found = channels.find(name);
    return found != channels.end() ? to_mat(found->second) : cv::Mat1f(size, fallback);
  };
  ViewPicture picture;
  cv::merge(std::vector<cv::Mat>{plane("B", 0), plane("G", 0), plane("R", 0)}, picture.bgr);
  if (picture.bgr.size() != size)
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: is {}x{} px, expected {}x{} as the frame that is put over it", exr.string(),
                            picture.bgr.cols, picture.bgr.rows, size.width, size.height));
  picture.alpha = plane("A", 1);
  picture.z = plane("Z", 0);
  picture.hole = plane("mask.hole", 0);
  return picture;
}

}  // namespace vantage
