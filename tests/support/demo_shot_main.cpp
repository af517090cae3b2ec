/// vantage-demo-shot: films the synthetic scene with unsynchronised cameras, as video files, and writes a shot.toml
/// that asks for everything: calibration and clocks estimated, depth, moving model, free viewpoint, slow motion,
/// stereo. For compositing: only what moves, before a green screen, or only the set; both with views.json, the same
/// explicit cameras.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/json.h"
#include "schema/formats/calibration.h"
#include "tests/support/synthetic_scene.h"

namespace {
namespace fs = std::filesystem;
using namespace vantage;
using synthetic::Stage;

struct DemoOptions {
  std::string out;
  int num_cameras = 5, num_frames = 20, width = 480, height = 270;
  bool known = false;          ///< exact calibration and clocks instead of estimated ones
  int num_hand_held = 0;       ///< the last ones
  Stage stage = Stage::Whole;  ///< what is left out, if anything
};

/// Writes frames to an H.264 file through the ffmpeg program.
class VideoFile {
 public:
  VideoFile(const fs::path& path, int width, int height, double fps) : path_(path) {
    const std::string command = fmt::format(
        "ffmpeg -y -loglevel error -f rawvideo -pix_fmt bgr24 -s {}x{} -r {} -i - -c:v libx264 -threads 1 -crf 12 "
        "-pix_fmt yuv420p '{}'",
        width, height, fps, path.string());
    pipe_ = popen(command.c_str(), "w");
    check(pipe_ != nullptr, "the ffmpeg program starts");
  }
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;
  void write(const cv::Mat3b& bgr) {
    check(std::fwrite(bgr.data, 3, bgr.total(), pipe_) == bgr.total(), "ffmpeg takes the picture");
  }
  void close() { check(pclose(pipe_) == 0, "ffmpeg writes " + path_.string()); }

 private:
  fs::path path_;
  FILE* pipe_;
};

void film(const synthetic::Scene& scene, const synthetic::SceneCamera& camera, const fs::path& file) {
  VideoFile video(file, camera.pinhole.width, camera.pinhole.height, camera.fps);
  for (int k = 0; k < camera.num_frames; ++k)
    video.write(scene.render(camera.pinhole, camera.pose(k), camera.time_s(k)).bgr);
  video.close();
}

void write_known_calibration(const std::vector<synthetic::SceneCamera>& cameras, const fs::path& folder) {
  Calibration calibration;
  for (const auto& c : cameras) {
    calibration.cameras[c.name] = {c.name, static_cast<int>(calibration.cameras.size()) + 1, c.pinhole, std::nullopt};
    for (int k = 0; k < c.num_frames; ++k) calibration.cam_from_world[{c.name, k}] = c.pose(k);
  }
  write_calibration(folder, calibration);
}

/// Times that every camera has filmed.
std::pair<double, double> common_time_s(const std::vector<synthetic::SceneCamera>& cameras) {
  double first = -1e9, last = 1e9;
  for (const auto& c : cameras) {
    first = std::max(first, c.time_s(0));
    last = std::min(last, c.time_s(c.num_frames - 1));
  }
  return {first, last};
}

/// Cameras between those of the arc while time runs on: the same for every stage.
Json composite_views(const DemoOptions& o, const std::vector<synthetic::SceneCamera>& cameras) {
  constexpr int kCount = 8;
  const auto [first, last] = common_time_s(cameras);
  const double step_deg = 7.0 * (o.num_cameras - 1) / (kCount - 1);
  Json views = Json::array();
  for (const auto& c : synthetic::arc_cameras(kCount, 1, o.width, o.height, step_deg, 0)) {
    const double f = 0.97 * o.width, share = (static_cast<double>(views.size()) + 1) / (kCount + 1);
    const auto& R = c.cam_from_world.R;
    const auto& t = c.cam_from_world.t;
    Json rows = Json::array();
    for (int row = 0; row < 3; ++row) rows.push_back({R(row, 0), R(row, 1), R(row, 2)});
    views.push_back({{"frame", views.size()},
                     {"time_s", first + share * (last - first)},
                     {"width", o.width},
                     {"height", o.height},
                     {"K", {{f, 0, o.width / 2.0}, {0, f, o.height / 2.0}, {0, 0, 1}}},
                     {"R", rows},
                     {"t", {t.x(), t.y(), t.z()}}});
  }
  return {{"version", 1}, {"views", views}};
}

/// The same path before the green screen and through the empty set.
std::string composite_toml(Stage stage) {
  std::string text = "[depth]\n\n[encode]\nbackground = \"#8040c0\"\n\n";
  text += "[[render]]\nname = \"path\"\nmode = \"view\"\nfps = 15\nviews = \"views.json\"\n";
  if (stage == Stage::GreenScreen)
    text += "matte = \"key\"\n# over = \"../set/out/render/path\"  # of the shot made with --empty-set\n";
  return text;
}

std::string shot_toml(const DemoOptions& o, const std::vector<synthetic::SceneCamera>& cameras) {
  std::string text = "[shot]\nname = \"demo\"\n\n";
  for (const auto& c : cameras) {
    text += fmt::format("[[camera]]\nname = \"{0}\"\nfootage = \"footage/{0}.mp4\"\n", c.name);
    if (c.sway_m > 0) text += "moving = true\n";
    if (o.stage == Stage::GreenScreen)
      text += fmt::format("key_color = \"#{:02x}\"\n", fmt::join(synthetic::kScreenRgb, ""));
    if (o.known) text += fmt::format("start_s = {:.9f}\n", c.offset_s);
    text += "\n";
  }
  text += o.known ? "[calibrate]\nmethod = \"known\"\nmodel = \"model\"\n\n[sync]\nmethod = \"known\"\n\n"
                  : "[calibrate]\nmethod = \"colmap\"\n\n[sync]\nmethod = \"motion\"\n\n";
  if (o.stage != Stage::Whole) return text + composite_toml(o.stage);
  text += "[depth]\n\n[reconstruct]\n";
  const auto [first, last] = common_time_s(cameras);
  const double early = first + 0.15 * (last - first), late = last - 0.15 * (last - first), middle = (first + last) / 2;
  const double side = 7.0 * (o.num_cameras - 1) / 2.0;  // degrees, a little inside the arc of 8 degrees a camera
  const auto key = [](double at, double time, double azimuth) {
    return fmt::format("  {{at_s = {:.3f}, time_s = {:.4f}, azimuth_deg = {:.2f}, elevation_deg = 14}},\n", at, time,
                       azimuth);
  };
  text += "\n# Time stands still while the camera flies round, then runs on at a fifth of its speed.\n";
  text += "[[render]]\nname = \"freeze\"\nmode = \"view\"\nfps = 15\nkeyframes = [\n" + key(0, early, -side) +
          key(1.0, early, side) + key(2.0, late, side / 2) + "]\n";
  text += "\n[[render]]\nname = \"stereo\"\nmode = \"stereo\"\nfps = 15\nkeyframes = [\n" + key(0, middle, -side / 2) +
          key(0.4, middle, side / 2) + "]\n";
  text += "\n[[render]]\nname = \"stereo_depth\"\nmode = \"stereo-depth\"\nfps = 15\nkeyframes = [\n" +
          key(0, early, 0) + key(0.4, late, 0) + "]\n";
  return text;
}

void make(const DemoOptions& o) {
  const synthetic::Scene scene({.moving = true, .supersample = 2, .noise_sigma = 1, .stage = o.stage});
  auto cameras = synthetic::arc_cameras(o.num_cameras, o.num_frames, o.width, o.height);
  for (int i = std::max(0, o.num_cameras - o.num_hand_held); i < o.num_cameras; ++i) {
    auto& held = cameras[static_cast<std::size_t>(i)];
    held.sway_m = 0.12, held.sway_deg = 1.5;
  }
  const fs::path out(o.out);
  fs::create_directories(out / "footage");
  for (const auto& c : cameras) {
    film(scene, c, out / "footage" / (c.name + ".mp4"));
    std::cout << fmt::format("{}: {} frames, first at {:+.4f} s\n", c.name, c.num_frames, c.offset_s) << std::flush;
  }
  write_known_calibration(cameras, out / (o.known ? "model" : "truth"));
  if (o.stage != Stage::Whole) write_json(out / "views.json", composite_views(o, cameras));
  write_file_atomically(out / "shot.toml", shot_toml(o, cameras));
}

}  // namespace

int main(int argc, char** argv) {
  DemoOptions options;
  CLI::App app("Films the synthetic demo scene with unsynchronised cameras and writes a shot.");
  app.add_option("out", options.out, "the shot's folder")->required();
  app.add_option("--cameras", options.num_cameras)->check(CLI::Range(2, 24));
  app.add_option("--frames", options.num_frames)->check(CLI::Range(1, 1000));
  app.add_option("--width", options.width)->check(CLI::Range(64, 3840));
  app.add_option("--height", options.height)->check(CLI::Range(64, 2160));
  app.add_option("--hand-held", options.num_hand_held, "how many of the cameras are held in the hand")
      ->check(CLI::Range(0, 24));
  app.add_flag("--known", options.known, "give exact calibration and clocks");
  const auto part_of_scene = [&](Stage stage) {  // has too little to calibrate by
    return [&options, stage](std::int64_t) { options.stage = stage, options.known = true; };
  };
  auto* green = app.add_flag_function("--green-screen", part_of_scene(Stage::GreenScreen),
                                      "only what moves, before a green screen, to be cut out; implies --known");
  app.add_flag_function("--empty-set", part_of_scene(Stage::WithoutMoving),
                        "only what stands still, for what was cut out to stand in; implies --known")
      ->excludes(green);
  CLI11_PARSE(app, argc, argv);
  try {
    make(options);
  } catch (const std::exception& e) {
    std::cerr << "vantage-demo-shot: " << e.what() << "\n";
    return 1;
  }
  return 0;
}
