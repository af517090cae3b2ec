#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "jobs/ingest/ingest_job.h"
#include "scheduler/cli/commands.h"
#include "scheduler/cli/parse.h"
#include "scheduler/cli/programs.h"
#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

struct InitOptions {
  fs::path shot;
  std::vector<std::string> footage;
  std::string name;
  bool force = false, json = false;
};

struct NewCamera {
  std::string name, footage;  ///< footage as shot.toml will say it
  Json probe;
};

InitOptions parse_options(const Arguments& arguments) {
  CLI::App app{"Writes SHOT/shot.toml from footage; every file is probed.", "vantage init"};
  InitOptions options;
  app.add_option("shot", options.shot, "folder of the shot; made when missing")->required();
  app.add_option("--camera", options.footage,
                 "video, folder of videos, or pattern of stills like 'left/*.png'; once per camera")
      ->required();
  app.add_option("--name", options.name, "name of the shot; the folder's when left out");
  app.add_flag("--force", options.force, "replace a shot.toml that is there");
  app.add_flag("--json", options.json, "for programs");
  parse(app, arguments);
  return options;
}

bool is_video(const fs::path& file) {
  static const std::set<std::string> suffixes{".mp4",  ".mov", ".avi",  ".mkv", ".mts", ".m2ts",
                                              ".webm", ".mpg", ".mpeg", ".m4v", ".3gp", ".mxf"};
  std::string suffix = file.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return suffixes.contains(suffix);
}

/// A folder stands for the videos in it; or, when it holds none, for every folder of stills in it, or its own stills.
std::vector<std::string> expand_folder(const fs::path& folder) {
  std::vector<fs::path> entries(fs::directory_iterator(folder), fs::directory_iterator{});
  std::sort(entries.begin(), entries.end());
  std::vector<std::string> videos, still_folders;
  for (const auto& entry : entries) {
    if (fs::is_regular_file(entry) && is_video(entry)) videos.push_back(entry.string());
    if (!fs::is_directory(entry)) continue;
    for (const auto& file : fs::directory_iterator(entry))
      if (is_still(file.path())) {
        still_folders.push_back((entry / ("*" + file.path().extension().string())).string());
        break;
      }
  }
  if (videos.empty() && still_folders.empty())
    throw Error(ErrorKind::BadInput, fmt::format("{}: holds no video and no folder of pictures", folder.string()));
  return videos.empty() ? still_folders : videos;
}

std::string unique_name(const fs::path& footage, const std::set<std::string>& taken) {
  const bool is_pattern = footage.filename().string().find_first_of("*?[") != std::string::npos;
  std::string name = is_pattern ? footage.parent_path().filename().string() : footage.stem().string();
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-') c = '_';
  if (name.empty()) name = "camera";
  std::string unique = name;
  for (int n = 2; taken.contains(unique); ++n) unique = fmt::format("{}_{}", name, n);
  return unique;
}

/// Relative when it lies in the shot's folder, so that the folder can be moved; absolute otherwise.
std::string footage_text(const fs::path& file, const fs::path& shot) {
  const fs::path absolute = fs::absolute(file).lexically_normal();
  const fs::path relative = absolute.lexically_relative(fs::absolute(shot).lexically_normal());
  return relative.empty() || *relative.begin() == ".." ? absolute.string() : relative.string();
}

std::vector<NewCamera> probe_cameras(const InitOptions& options) {
  std::vector<std::string> files;
  for (const auto& entry : options.footage) {
    if (!fs::is_directory(entry))
      files.push_back(entry);
    else
      for (auto& file : expand_folder(entry)) files.push_back(std::move(file));
  }
  const Json probes = probe_footage_files(files);
  std::vector<NewCamera> cameras;
  std::set<std::string> names;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (probes.at(i).contains("error")) throw Error(ErrorKind::BadInput, probes.at(i).at("error").get<std::string>());
    cameras.push_back({unique_name(files[i], names), footage_text(files[i], options.shot), probes.at(i)});
    names.insert(cameras.back().name);
  }
  if (cameras.size() < 2)
    throw Error(ErrorKind::BadInput,
                fmt::format("{} camera given, needs two or more to see depth between them", cameras.size()));
  return cameras;
}

/// A TOML basic string.
std::string quoted(const std::string& text) { return Json(text).dump(); }

std::string camera_tables(const std::vector<NewCamera>& cameras) {
  std::string out;
  for (const auto& camera : cameras) {
    const Json& p = camera.probe;
    const bool stills = p.value("is_stills", false);
    out += fmt::format("[[camera]]  # {} x {}, {} {}\nname = {}\nfootage = {}\n", p.at("width").get<int>(),
                       p.at("height").get<int>(), p.at("num_frames").get<int>(),
                       stills ? "stills" : fmt::format("frames, {:.4g} fps", p.at("fps").get<double>()),
                       quoted(camera.name), quoted(camera.footage));
    if (stills) out += "fps = 30      # of the stills\n";
    out += "\n";
  }
  return out;
}

/// Middle of the footage all cameras should share, s.
double middle_s(const std::vector<NewCamera>& cameras) {
  double shortest = 1e9;
  for (const auto& camera : cameras) {
    const Json& p = camera.probe;
    const double length_s =
        p.value("is_stills", false) ? p.at("num_frames").get<double>() / 30 : p.at("duration_s").get<double>();
    shortest = std::min(shortest, length_s);
  }
  return shortest / 2;
}

std::string render_tables(const std::vector<NewCamera>& cameras) {
  const double middle = middle_s(cameras), slow = std::min(0.5, middle / 2);
  return fmt::format(R"([[render]]    # freeze the scene and walk around it, then go on in slow motion
name = "freeze"
mode = "view"
fps = 30
keyframes = [
  {{ at_s = 0.0, time_s = {0:.3f}, azimuth_deg = 0.0, elevation_deg = 0.0 }},
  {{ at_s = 1.0, time_s = {0:.3f}, azimuth_deg = -8.0, elevation_deg = 0.0 }},
  {{ at_s = 2.0, time_s = {0:.3f}, azimuth_deg = 8.0, elevation_deg = 0.0 }},
  {{ at_s = 3.0, time_s = {1:.3f}, azimuth_deg = 0.0, elevation_deg = 0.0 }},
]

[[render]]    # two eyes
name = "stereo"
mode = "stereo"
fps = 30
keyframes = [
  {{ at_s = 0.0, time_s = {2:.3f}, azimuth_deg = 0.0, elevation_deg = 0.0 }},
  {{ at_s = {3:.3f}, time_s = {1:.3f}, azimuth_deg = 0.0, elevation_deg = 0.0 }},
]
)",
                     middle, middle + slow, middle - slow, std::max(0.1, 2 * slow));
}

std::string shot_file(const InitOptions& options, const std::vector<NewCamera>& cameras) {
  const std::string name =
      options.name.empty() ? fs::absolute(options.shot).lexically_normal().filename().string() : options.name;
  return fmt::format(
      R"(# A shot: one scene, several cameras. 'vantage check' reads this file, 'vantage run' does the work.

[shot]
name = {}

{}[calibrate]   # method = "known" with model = "folder" takes a COLMAP text model
method = "colmap"

[sync]        # "motion" finds when each camera started from what moves, "audio" from sound, "known" takes start_s of each camera
method = "motion"

[depth]       # depth of every picture; remove the table to do without

[reconstruct] # a moving model of the scene; remove the table to do without

{})",
      quoted(name), camera_tables(cameras), render_tables(cameras));
}

}  // namespace

int init_command(const Arguments& arguments) {
  const InitOptions options = parse_options(arguments);
  const fs::path file = options.shot / "shot.toml";
  if (fs::exists(file) && !options.force)
    throw Error(ErrorKind::BadInput, fmt::format("{}: is there already; --force replaces it", file.string()));
  const auto cameras = probe_cameras(options);
  fs::create_directories(options.shot);
  write_file_atomically(file, shot_file(options, cameras));
  if (options.json) {
    Json list = Json::array();
    for (const auto& camera : cameras)
      list.push_back({{"name", camera.name}, {"footage", camera.footage}, {"probe", camera.probe}});
    fmt::print("{}\n", Json{{"file", file.string()}, {"cameras", list}}.dump());
    return kExitOk;
  }
  for (const auto& camera : cameras) {
    const Json& p = camera.probe;
    fmt::print("{:<12} {} x {}, {} frames  {}\n", camera.name, p.at("width").get<int>(), p.at("height").get<int>(),
               p.at("num_frames").get<int>(), camera.footage);
    for (const auto& warning : p.at("warnings")) fmt::print("{:<12} warning: {}\n", "", warning.get<std::string>());
  }
  fmt::print("\nWrote {}. Next: vantage check {}\n", file.string(), options.shot.string());
  return kExitOk;
}

}  // namespace vantage
