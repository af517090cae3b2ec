#pragma once
/// A small ray-traced world with exact truth: textured floor and wall, a static box and ball, two balls and a box that
/// move. World: metres, x right, y down like the cameras' (ground at y = 0, cameras above it at y < 0), z away from the
/// cameras.
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "schema/formats/camera.h"

namespace vantage::synthetic {

struct Picture {
  cv::Mat3b bgr;
  cv::Mat1f depth;  ///< along the optical axis, metres
  cv::Mat1b id;     ///< object; 0 floor, 1 wall, 2… static things, kFirstMovingId… moving things
};
constexpr int kFirstMovingId = 10;  ///< 10 bouncing ball, 11 rising ball, 12 turning box

/// A camera of a shot, with its own clock: static, or held in the hand.
struct SceneCamera {
  std::string name;
  Pinhole pinhole;
  RigidTransform cam_from_world;  ///< a held camera's: what it sways about
  double offset_s = 0;            ///< shot time of frame 0
  double fps = 30;
  int num_frames = 0;
  double sway_m = 0, sway_deg = 0;  ///< amplitudes of a held camera's slow walk and turn; its tremor is a tenth of them
  double time_s(int frame) const { return offset_s + frame / fps; }
  RigidTransform pose(int frame) const;
};

struct Truth {
  cv::Mat2f motion_px;  ///< pixel x of the first picture lies at x + motion in the second
  cv::Mat1b visible;    ///< 255 where the surface is seen in the second picture, too
};

/// Before a screen there are only the things that move; the screen hangs where wall and floor are, evenly lit to within
/// a few percent, and shines on the things' rims a little.
enum class Stage { Whole, GreenScreen, WithoutMoving };
constexpr unsigned char kScreenRgb[3] = {60, 188, 72};  ///< the middle of what cameras see of the screen

struct SceneOptions {
  bool moving = true;      ///< false: nothing moves
  int supersample = 2;     ///< rays per pixel and axis
  double noise_sigma = 0;  ///< 8-bit levels, seeded
  Stage stage = Stage::Whole;
};

class Scene {
 public:
  explicit Scene(SceneOptions options = {});
  Picture render(const Pinhole& pinhole, const RigidTransform& cam_from_world, double time_s) const;
  /// Exact correspondence from picture a (rendered at a's pose and time) to camera b at another time.
  Truth correspondence(const Picture& a, const Pinhole& pinhole_a, const RigidTransform& a_from_world, double time_a_s,
                       const Pinhole& pinhole_b, const RigidTransform& b_from_world, double time_b_s) const;
  /// World position at time_to of the surface point that is at `point` of object id at time_from.
  Eigen::Vector3d moved(int id, const Eigen::Vector3d& point, double time_from_s, double time_to_s) const;
  /// Velocity of a surface point, m/s.
  Eigen::Vector3d velocity(int id, const Eigen::Vector3d& point, double time_s) const;
  /// Distance of a world point to the nearest surface at that time, metres.
  double distance_to_surface(const Eigen::Vector3d& point, double time_s) const;
  Eigen::Vector3d centre() const;

 private:
  SceneOptions options_;
};

/// Cameras on an arc around the centre of the scene, radius 4 m, all looking at it. Offsets are uneven and not whole
/// frames. elevation_wobble_deg: neighbours alternate in height, so that time can be told from horizontal motion.
std::vector<SceneCamera> arc_cameras(int num_cameras, int num_frames, int width, int height, double step_deg = 8,
                                     double elevation_wobble_deg = 4);

}  // namespace vantage::synthetic
