/// Clocks of cameras from the 2-D tracks of one flying object (data sets of Li, Albl et al., IROS 2020), by the solver
/// for pairs whose poses are unknown: each pair from an unknown start, against published maps if there are any, and how
/// well offsets close around every three cameras. Not for ctest: it needs the data.
///
///   drone_tracks_bench FOLDER [--maps FILE] [--window-s 10] [--apart cam1]
///
/// FOLDER: cameras.txt ("cam0 - gopro3" a line), gopro3.json … (K-matrix, distCoeff, fps, resolution), detections/*.txt
/// (frame from 1, x, y; 0 0: not seen). FILE: text with the two tables of such a data set's README, headed "alpha" and
/// "beta": frame j = alpha i + beta.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <map>
#include <opencv2/calib3d.hpp>
#include <random>
#include <regex>
#include <set>
#include <sstream>

#include "jobs/sync/free_pair.h"
#include "schema/base/error.h"
#include "schema/base/json.h"

namespace vantage {
namespace {

namespace fs = std::filesystem;

struct DroneCamera {
  std::string name;
  double fps = 0;
  Pinhole lens;
  std::vector<sync::TimedTrack> pieces;  // between gaps
  double last_s = 0;
};

struct LinearMap {
  double alpha = 1, beta = 0;  // frame of b = alpha * frame of a + beta
};
using Maps = std::map<std::pair<std::size_t, std::size_t>, LinearMap>;

struct Options {
  fs::path folder, maps;
  double window_s = 10;
  std::set<std::string> apart;
};

std::vector<std::string> lines_of(const fs::path& file) {
  std::ifstream in(file);
  if (!in) throw Error(ErrorKind::BadInput, fmt::format("{}: cannot be read", file.string()));
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// Seen points in the ideal pinhole's pixels, a track for every stretch without a gap of over three frames.
std::vector<sync::TimedTrack> read_pieces(const fs::path& file, double fps, const cv::Matx33d& K,
                                          const std::vector<double>& lens, double& last_s) {
  constexpr double kMaxGapFrames = 3;
  constexpr std::size_t kMinPieceFrames = 8;
  std::vector<double> times;
  std::vector<cv::Point2d> px;
  for (const std::string& line : lines_of(file)) {
    std::istringstream in(line);
    double frame = 0, x = 0, y = 0;
    if (!(in >> frame >> x >> y)) continue;  // heading
    last_s = frame / fps;
    if (x == 0 && y == 0) continue;
    times.push_back(frame / fps);
    px.emplace_back(x, y);
  }
  if (px.empty()) throw Error(ErrorKind::BadInput, fmt::format("{}: no detection in it", file.string()));
  std::vector<cv::Point2d> ideal;
  cv::undistortPoints(px, ideal, K, lens, cv::noArray(), K);
  std::vector<sync::TimedTrack> pieces;
  for (std::size_t first = 0, k = 1; k <= ideal.size(); ++k) {
    if (k < ideal.size() && times[k] - times[k - 1] < (kMaxGapFrames + 0.5) / fps) continue;
    if (k - first >= kMinPieceFrames) {
      std::vector<Eigen::Vector2d> piece;
      for (std::size_t i = first; i < k; ++i) piece.emplace_back(ideal[i].x, ideal[i].y);
      pieces.emplace_back(std::vector<double>(times.begin() + static_cast<std::ptrdiff_t>(first),
                                              times.begin() + static_cast<std::ptrdiff_t>(k)),
                          std::move(piece));
    }
    first = k;
  }
  return pieces;
}

DroneCamera read_camera(const fs::path& folder, const std::string& name, const std::string& device) {
  DroneCamera camera{.name = name, .lens = {}, .pieces = {}};
  fs::path file = folder / (device + ".json");
  if (!fs::exists(file)) file = folder / (device + "_1.json");
  const Json json = read_json(file);
  camera.fps = json.at("fps");
  const auto K = json.at("K-matrix").get<std::vector<std::vector<double>>>();
  camera.lens = {json.at("resolution").at(0), json.at("resolution").at(1), K[0][0], K[1][1], K[0][2], K[1][2]};
  const cv::Matx33d matrix(K[0][0], 0, K[0][2], 0, K[1][1], K[1][2], 0, 0, 1);
  camera.pieces = read_pieces(folder / "detections" / (name + ".txt"), camera.fps, matrix,
                              json.at("distCoeff").get<std::vector<double>>(), camera.last_s);
  return camera;
}

std::vector<DroneCamera> read_cameras(const fs::path& folder) {
  static const std::regex kLine(R"(\s*(\S+)\s+-\s+(\S+)\s*)");
  std::vector<DroneCamera> cameras;
  for (const std::string& line : lines_of(folder / "cameras.txt"))
    if (std::smatch m; std::regex_match(line, m, kLine)) cameras.push_back(read_camera(folder, m[1], m[2]));
  return cameras;
}

/// Rows "| 0 | 1.0 | …" of the tables under headings that name alpha and beta.
Maps read_maps(const fs::path& file) {
  Maps maps;
  enum { Neither, Alpha, Beta } table = Neither;
  for (std::string line : lines_of(file)) {
    if (line.starts_with("#"))
      table = line.find("(alpha)") != line.npos ? Alpha : line.find("(beta)") != line.npos ? Beta : Neither;
    if (table == Neither || !line.starts_with("|")) continue;
    std::replace(line.begin(), line.end(), '|', ' ');
    std::istringstream in(line);
    std::size_t row = 0;
    if (!(in >> row)) continue;
    double value = 0;
    for (std::size_t column = 0; in >> value; ++column)
      (table == Alpha ? maps[{row, column}].alpha : maps[{row, column}].beta) = value;
  }
  return maps;
}

struct Result {
  std::size_t a = 0, b = 0;
  sync::FreePairAnswer answer;
  PairOffset offset;
};

/// t_b = (t_a - offset) / rate of the published map, as an offset at a's time; frames count from 1 in both.
double published_time_b_s(const LinearMap& map, const DroneCamera& a, const DroneCamera& b, double time_a_s) {
  return (map.alpha * time_a_s * a.fps + map.beta) / b.fps;
}

Result solve_pair(const std::vector<DroneCamera>& cameras, std::size_t i, std::size_t j, double centre_s,
                  double window_s) {
  const DroneCamera &a = cameras[i], &b = cameras[j];
  sync::FreePairInput in{.pairs = {}, .still = {}, .range = {}, .lens_a = a.lens, .lens_b = b.lens};
  in.frame_s = std::max(1 / a.fps, 1 / b.fps);
  in.width_a_px = a.lens.width;
  in.range = {centre_s - window_s, centre_s + window_s, 0.5 * std::min(1 / a.fps, 1 / b.fps), a.last_s, b.last_s};
  for (const auto& piece_a : a.pieces)
    for (const auto& piece_b : b.pieces)
      if (piece_b.begin_s() + in.range.min_s < piece_a.end_s() && piece_b.end_s() + in.range.max_s > piece_a.begin_s())
        in.pairs.push_back({piece_a, piece_b});
  Result result{i, j, sync::solve_free_pair(in), {.a = a.name, .b = b.name, .method = {}, .verdict = {}}};
  sync::judge_free_pair(result.offset, result.answer, {.frame_s = in.frame_s});
  return result;
}

double median(std::vector<double> values) {
  if (values.empty()) return NAN;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Largest difference over the middle of the overlap, in seconds of b.
double difference_s(const Result& r, const LinearMap& map, const std::vector<DroneCamera>& cameras) {
  const PairOffset& o = r.offset;
  const double time_a_s = o.offset_s + o.rate * r.answer.fit->clock.pivot_b_s;
  return r.answer.fit->clock.pivot_b_s - published_time_b_s(map, cameras[r.a], cameras[r.b], time_a_s);
}

/// a → b → c against a → c at the middle of a's time.
std::vector<double> cycle_closures_s(const std::vector<Result>& results) {
  std::map<std::pair<std::size_t, std::size_t>, const Result*> by;
  for (const Result& r : results)
    if (r.offset.determined) by[{r.a, r.b}] = &r;
  std::vector<double> closures;
  const auto to_b = [](const Result& r, double t) { return (t - r.offset.offset_s) / r.offset.rate; };
  for (const auto& [ab, first] : by)
    for (const auto& [bc, second] : by) {
      const auto direct = by.find({ab.first, bc.second});
      if (bc.first != ab.second || direct == by.end()) continue;
      const double time_a_s =
          direct->second->offset.offset_s + direct->second->offset.rate * direct->second->answer.fit->clock.pivot_b_s;
      closures.push_back(std::abs(to_b(*second, to_b(*first, time_a_s)) - to_b(*direct->second, time_a_s)));
    }
  return closures;
}

void report(const std::vector<Result>& results, const std::vector<DroneCamera>& cameras, const Maps& maps,
            const Options& options) {
  std::vector<double> differences;
  int num = 0, num_within = 0;
  for (const Result& r : results) {
    std::string text = fmt::format("{} {}  {}", r.offset.a, r.offset.b, r.offset.verdict);
    const auto map = maps.find({r.a, r.b});
    const bool apart = options.apart.contains(r.offset.a) || options.apart.contains(r.offset.b);
    if (map != maps.end() && r.answer.fit) {
      const double d = difference_s(r, map->second, cameras);
      const double frame_s = std::max(1 / cameras[r.a].fps, 1 / cameras[r.b].fps);
      text += fmt::format("; rate {:.6f}, noise {:.2f} px, bias {:.2f} px; from the published map {:+.1f} ms{}",
                          r.offset.rate, r.answer.fit->clock.noise_px, r.answer.fit->clock.bias_px, 1e3 * d,
                          apart ? " (apart)" : "");
      if (!apart) {
        ++num;
        num_within += r.offset.determined && std::abs(d) < frame_s ? 1 : 0;
        differences.push_back(std::abs(d));
      }
    }
    fmt::print("{}\n", text);
  }
  const auto closures = cycle_closures_s(results);
  const Json json{
      {"pairs", num},
      {"within_a_frame", num_within},
      {"median_difference_ms", 1e3 * median(differences)},
      {"cycles", closures.size()},
      {"median_closure_ms", 1e3 * median(closures)},
      {"max_closure_ms", closures.empty() ? NAN : 1e3 * *std::max_element(closures.begin(), closures.end())},
      {"cpu_s_per_pair", static_cast<double>(std::clock()) / CLOCKS_PER_SEC / static_cast<double>(results.size())}};
  fmt::print("{}\n", json.dump());
}

Options parse(int argc, char** argv) {
  Options options;
  for (int k = 1; k < argc; ++k) {
    const std::string flag = argv[k];
    const auto value = [&] {
      if (++k >= argc) throw Error(ErrorKind::BadInput, flag + " needs a value");
      return std::string(argv[k]);
    };
    if (flag == "--maps")
      options.maps = value();
    else if (flag == "--window-s")
      options.window_s = std::stod(value());
    else if (flag == "--apart")
      options.apart.insert(value());
    else if (options.folder.empty() && !flag.starts_with("-"))
      options.folder = flag;
    else
      throw Error(ErrorKind::BadInput, fmt::format("'{}' is not understood", flag));
  }
  if (options.folder.empty())
    throw Error(ErrorKind::BadInput, "usage: drone_tracks_bench FOLDER [--maps FILE] [--window-s 10] [--apart cam1]");
  return options;
}

void run(const Options& options) {
  const std::vector<DroneCamera> cameras = read_cameras(options.folder);
  const Maps maps = options.maps.empty() ? Maps{} : read_maps(options.maps);
  std::mt19937 random(4);
  std::vector<Result> results;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    for (std::size_t j = i + 1; j < cameras.size(); ++j) {
      // With a map the window holds its offset, but anywhere: the solver must not gain by looking at the middle.
      double centre_s = 0;
      if (const auto map = maps.find({i, j}); map != maps.end()) {
        const double middle_s = 0.5 * cameras[i].last_s;
        const double off_centre = 1.6 * (static_cast<double>(random() % 1000) / 1000 - 0.5);
        centre_s = middle_s - published_time_b_s(map->second, cameras[i], cameras[j], middle_s) +
                   off_centre * options.window_s;
      }
      results.push_back(solve_pair(cameras, i, j, centre_s, options.window_s));
    }
  report(results, cameras, maps, options);
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  try {
    vantage::run(vantage::parse(argc, argv));
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
  return 0;
}
