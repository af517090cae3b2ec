#include "jobs/render/pixel_places.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "jobs/render/behind_edges.h"
#include "jobs/render/beside_motion.h"
#include "jobs/render/filled_depth.h"
#include "jobs/vision/vector_clones.h"

namespace vantage {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr float kMinFlowConfidence = 0.1F;
// Maps are right to about 0.3 px: what a static point explains that well does not move; above, motion fades in.
constexpr double kStatic_px = 0.35, kMoving_px = 0.9;
// Depth is right to 10 to 20 %, which is within the maps' error as long as all parallax is within a few pixels.
constexpr double kNoParallax_px = 0.5, kParallax_px = 4;
constexpr float kHidden = 0.1F;    ///< so much of depth farther is what the other frame hides
constexpr float kCarried = 0.05F;  ///< what it counts
constexpr float kPassing = 0.1F;   ///< so much nearer is what moves
constexpr float kSurely_px = 2;    ///< a motion that is no error of the map

/// A projection along one row: homogeneous pixel = z * (slope * column + start) + constant.
struct RowProjection {
  float slope[3], start[3], constant[3];
  float row;  ///< y of the row's pixel centres
};

VANTAGE_VECTOR_CLONES
void project_row(const RowProjection& p, const float* z, std::size_t width, float* x_out, float* y_out, float* z_out) {
  for (std::size_t x = 0; x < width; ++x) {
    const float column = static_cast<float>(static_cast<int>(x)) + 0.5F;
    const float u = z[x] * (p.slope[0] * column + p.start[0]) + p.constant[0];
    const float v = z[x] * (p.slope[1] * column + p.start[1]) + p.constant[1];
    const float w = z[x] * (p.slope[2] * column + p.start[2]) + p.constant[2];
    x_out[x] = u / w;
    y_out[x] = v / w;
    z_out[x] = w;
  }
}

/// Squared distance of each pixel's place in another image from where the map says it is.
VANTAGE_VECTOR_CLONES
void squared_misses(const RowProjection& p, const float* z, const float* motion, std::size_t width, float* out) {
  for (std::size_t x = 0; x < width; ++x) {
    const float column = static_cast<float>(static_cast<int>(x)) + 0.5F;
    const float u = z[x] * (p.slope[0] * column + p.start[0]) + p.constant[0];
    const float v = z[x] * (p.slope[1] * column + p.start[1]) + p.constant[1];
    const float w = z[x] * (p.slope[2] * column + p.start[2]) + p.constant[2];
    const float dx = u / w - column - motion[2 * x], dy = v / w - p.row - motion[2 * x + 1];
    out[x] = dx * dx + dy * dy;
  }
}

RowProjection along_row(const Eigen::Matrix3d& H, const Vector3d& h, int y) {
  RowProjection p{};
  const Vector3d start = H.col(1) * (y + 0.5) + H.col(2);
  p.row = static_cast<float>(y) + 0.5F;
  for (int k = 0; k < 3; ++k) {
    p.slope[k] = static_cast<float>(H(k, 0));
    p.start[k] = static_cast<float>(start[k]);
    p.constant[k] = static_cast<float>(h[k]);
  }
  return p;
}

}  // namespace

PixelPlaces::PixelPlaces(std::span<const SourceImage> images, int i, const ViewCamera& view,
                         const PlacingOptions& options)
    : images_(images),
      i_(static_cast<std::size_t>(i)),
      image_(images[i_]),
      view_(view),
      options_(options),
      depth_(options.method == "correspondence" ? triangulated_depth(images, i) : image_.depth),
      later_(frame_across()),
      into_view_(projection_to(view.pinhole, view.cam_from_world)) {
  if (depth_.z.empty()) depth_.z = depth_.confidence = cv::Mat1f(image_.bgr.size(), 0.0F);
  z_ = filled_depth(depth_.z, options.scene_distance);
  cv::Mat1f confidence;  // the image's own stays as it is
  cv::multiply(depth_.confidence, worth_behind_edges(z_), confidence);
  depth_.confidence = confidence;
  if (later_ < 0) return;
  const SourceImage& later = images_[static_cast<std::size_t>(later_)];
  into_later_ = projection_to(later.pinhole, later.cam_from_world);
  depth_counts_ = worth_of_depth();
  if (depth_counts_ >= 1) return;
  const FlowMap& flow = image_.flows.at(later_);
  cv::multiply(flow.confidence, worth_beside_motion(flow.motion_px), seen_later_);
}

/// 0 where the parallax between image and view is within the maps' error, 1 from a few pixels on.
double PixelPlaces::worth_of_depth() const {
  const double away = (view_.cam_from_world.centre() - image_.cam_from_world.centre()).norm();
  double parallax_px = view_.pinhole.fx * away / options_.scene_distance;
  if (view_.disparity)
    parallax_px += 2 * std::abs(view_.disparity->shift_px(options_.scene_distance) -
                                view_.disparity->shift_px(2 * options_.scene_distance));
  const double t = std::clamp((parallax_px - kNoParallax_px) / (kParallax_px - kNoParallax_px), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

PixelPlaces::Projection PixelPlaces::projection_to(const Pinhole& pinhole, const RigidTransform& cam_from_world) const {
  const Eigen::Matrix3d R = cam_from_world.R * image_.cam_from_world.R.transpose();
  return {pinhole.K() * R * image_.pinhole.K().inverse(),
          pinhole.K() * (cam_from_world.t - R * image_.cam_from_world.t)};
}

void PixelPlaces::row(int y, PlacedRow& out) const {
  if (options_.method == "plain") return plain_row(y, out);
  static_row(y, out);
  const bool always = options_.method == "correspondence", unknown = options_.method == "auto";
  const float *known = depth_.z[y], *confidence = depth_.confidence[y];
  const std::size_t width = out.x.size();
  std::vector<float> misses(later_ < 0 || always ? 0 : width);
  if (!misses.empty())
    squared_misses(along_row(into_later_.H, into_later_.h, y), z_[y], image_.flows.at(later_).motion_px.ptr<float>(y),
                   width, misses.data());
  for (std::size_t x = 0; x < width; ++x) {
    const bool moved = known[x] > 0 && !misses.empty() && misses[x] > kStatic_px * kStatic_px;
    out.confidence[x] = known[x] > 0 ? std::max(kGuess, confidence[x]) : kGuess;
    if (always || moved || (unknown && known[x] <= 0)) put(place(static_cast<int>(x), y), x, out);
  }
  put_in_order(y, misses, out);
}

/// Depth counts as far as parallax does; else what the other frame shows too is in front and counts more, and so is
/// what moves: before the background that it passes. squared_motion_px: of each pixel; empty when nothing moves.
void PixelPlaces::put_in_order(int y, const std::vector<float>& squared_motion_px, PlacedRow& out) const {
  const float depth_counts = static_cast<float>(depth_counts_), middle = static_cast<float>(options_.scene_distance);
  const float* seen = seen_later_.empty() ? nullptr : seen_later_[y];
  for (std::size_t x = 0; x < out.z.size(); ++x) {
    out.order[x] = out.z[x];
    if (!seen || out.z[x] <= 0) continue;
    const float moves =
        squared_motion_px.empty() ? 0 : std::min(1.0F, squared_motion_px[x] / (kSurely_px * kSurely_px));
    const float farther = kHidden * (1 - seen[x]) - kPassing * moves;
    out.order[x] = (middle + depth_counts * (out.z[x] - middle)) * (1 + (1 - depth_counts) * farther);
    out.confidence[x] = depth_counts * out.confidence[x] + (1 - depth_counts) * std::max(kCarried, seen[x]);
  }
}

/// All pixels as if nothing moved.
void PixelPlaces::static_row(int y, PlacedRow& out) const {
  project_row(along_row(into_view_.H, into_view_.h, y), z_[y], out.x.size(), out.x.data(), out.y.data(), out.z.data());
  if (!view_.disparity) return;
  for (std::size_t x = 0; x < out.x.size(); ++x)
    if (out.z[x] > 0) out.x[x] += static_cast<float>(view_.disparity->shift_px(out.z[x]));
}

void PixelPlaces::put(const Placed& placed, std::size_t x, PlacedRow& out) const {
  const Vector3d p = view_.cam_from_world * placed.world;
  out.z[x] = static_cast<float>(p.z());
  out.confidence[x] = placed.confidence;
  if (p.z() <= 0) return;
  const Vector2d px = view_.pinhole.project(p);
  out.x[x] = static_cast<float>(px.x() + (view_.disparity ? view_.disparity->shift_px(p.z()) : 0));
  out.y[x] = static_cast<float>(px.y());
}

PixelPlaces::Placed PixelPlaces::place(int x, int y) const {
  const Vector3d here = world_of(image_, {x + 0.5, y + 0.5}, z_(y, x));
  const float known = depth_.z(y, x) <= 0 ? 0.0F : depth_.confidence(y, x);
  if (options_.method == "correspondence") return by_correspondence(x, y, here, known > 0 ? 1.0F : 0.5F);
  if (known > 0) return {here + motion(x, y, here), std::max(known, kGuess)};
  return by_correspondence(x, y, here, 0.3F);
}

/// X = Σ mu_k X_k over the images that show the point. trust: of places that correspondences alone give.
PixelPlaces::Placed PixelPlaces::by_correspondence(int x, int y, const Vector3d& here, float trust) const {
  Vector3d sum = Vector3d::Zero();
  double seen = 0, mu = 0;
  for (std::size_t k = 0; k < images_.size(); ++k) {
    if (options_.mu[k] <= 0) continue;
    mu += options_.mu[k];
    const std::optional<Vector3d> there = k == i_ ? std::optional(here) : matched(static_cast<int>(k), x, y, here);
    sum += options_.mu[k] * there.value_or(here);
    if (there) seen += options_.mu[k];
  }
  const double rest = 1 - mu;  // weights of images that are not there
  return {sum + rest * here, std::max(kGuess, trust * static_cast<float>(seen))};
}

/// The point on the ray of the pixel's match in image k, as deep there as `here` is.
std::optional<Vector3d> PixelPlaces::matched(int k, int x, int y, const Vector3d& here) const {
  const auto flow = image_.flows.find(k);
  if (flow == image_.flows.end() || flow->second.confidence(y, x) < kMinFlowConfidence) return std::nullopt;
  const SourceImage& other = images_[static_cast<std::size_t>(k)];
  const double z = (other.cam_from_world * here).z();
  if (z <= 0) return std::nullopt;
  const cv::Vec2f m = flow->second.motion_px(y, x);
  return world_of(other, {x + 0.5 + m[0], y + 0.5 + m[1]}, z);
}

/// The image of the same camera whose time lies on the other side of the view's time, or else the nearest in time; -1
/// when no map leads to one.
int PixelPlaces::frame_across() const {
  int best = -1;
  double best_badness = 0;
  for (const auto& [k, flow] : image_.flows) {
    const SourceImage& other = images_[static_cast<std::size_t>(k)];
    if (other.id.camera != image_.id.camera || other.time_s == image_.time_s) continue;
    const double share = (options_.time_s - image_.time_s) / (other.time_s - image_.time_s);
    const double badness = std::abs(share - 0.5);
    if (best >= 0 && badness >= best_badness) continue;
    best = k;
    best_badness = badness;
  }
  return best;
}

/// How far a surface that moves gets until the view's time.
Vector3d PixelPlaces::motion(int x, int y, const Vector3d& here) const {
  const FlowMap* flow = later_ < 0 ? nullptr : &image_.flows.at(later_);
  if (!flow) return Vector3d::Zero();
  const SourceImage& other = images_[static_cast<std::size_t>(later_)];
  const Vector3d still = other.cam_from_world * here;
  if (still.z() <= 0) return Vector3d::Zero();
  const cv::Vec2f m = flow->motion_px(y, x);
  const Vector2d there_px(x + 0.5 + m[0], y + 0.5 + m[1]);
  const double moved_px = (other.pinhole.project(still) - there_px).norm();
  const double sampled = sample_depth(other.depth.z, there_px);
  const bool plausible = sampled > 0 && std::abs(sampled / still.z() - 1) < 0.1;
  const Vector3d there =
      world_of(other, there_px, plausible ? still.z() + depth_counts_ * (sampled - still.z()) : still.z());
  const double share = (options_.time_s - image_.time_s) / (other.time_s - image_.time_s);
  const double fade = std::clamp((moved_px - kStatic_px) / (kMoving_px - kStatic_px), 0.0, 1.0);
  return std::clamp(share, -2.0, 3.0) * fade * (there - here);
}

/// Eq. 6. Depth here is only an order: 1 for what does not move from image to image, less for what does.
void PixelPlaces::plain_row(int y, PlacedRow& out) const {
  struct Part {
    double mu;
    const SourceImage* image;
    const FlowMap* flow;  ///< null: the image itself
    Eigen::Matrix3d at_infinity;
  };
  std::vector<Part> parts;
  for (std::size_t k = 0; k < images_.size(); ++k) {
    const auto flow = image_.flows.find(static_cast<int>(k));
    if (options_.mu[k] <= 0 || (k != i_ && flow == image_.flows.end())) continue;
    const Eigen::Matrix3d R = view_.cam_from_world.R * images_[k].cam_from_world.R.transpose();
    parts.push_back({options_.mu[k], &images_[k], k == i_ ? nullptr : &flow->second,
                     view_.pinhole.K() * R * images_[k].pinhole.K().inverse()});
  }
  const Eigen::Matrix3d own = into_view_.H;
  for (std::size_t x = 0; x < out.x.size(); ++x) {
    const int column = static_cast<int>(x);
    const Vector2d here = (own * Vector3d(column + 0.5, y + 0.5, 1)).hnormalized();
    Vector2d sum = Vector2d::Zero();
    double seen = 0;
    for (const Part& part : parts) {
      if (part.flow && part.flow->confidence(y, column) < kMinFlowConfidence) continue;
      const cv::Vec2f m = part.flow ? part.flow->motion_px(y, column) : cv::Vec2f(0, 0);
      sum += part.mu * (part.at_infinity * Vector3d(column + 0.5 + m[0], y + 0.5 + m[1], 1)).hnormalized();
      seen += part.mu;
    }
    const Vector2d px = seen > 0 ? Vector2d(sum + (1 - seen) * here) : here;
    out.x[x] = static_cast<float>(px.x());
    out.y[x] = static_cast<float>(px.y());
    out.z[x] = out.order[x] = static_cast<float>(1 / (1 + (px - here).norm() / view_.pinhole.width));
    out.confidence[x] = std::max(kGuess, static_cast<float>(seen));
  }
}

}  // namespace vantage
