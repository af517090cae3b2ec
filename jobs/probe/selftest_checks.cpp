#include "jobs/probe/selftest_checks.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <random>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "schema/base/program.h"
#include "schema/formats/exr.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr int kWidth = 64, kHeight = 48;
constexpr int kNumPictures = 8;

[[noreturn]] void fail(const std::string& why) { throw Error(ErrorKind::Transient, why); }

/// Grey, brighter from picture to picture: survives every codec.
cv::Mat3b picture(int k) {
  const auto grey = static_cast<unsigned char>(40 + 20 * k);
  return cv::Mat3b(kHeight, kWidth, cv::Vec3b(grey, grey, grey));
}

/// FFmpeg encodes, OpenCV decodes.
void check_film(const fs::path& folder) {
  std::string raw;
  for (int k = 0; k < kNumPictures; ++k) {
    const cv::Mat3b p = picture(k);
    raw.append(reinterpret_cast<const char*>(p.data), p.total() * p.elemSize());
  }
  write_file_atomically(folder / "pictures.bgr", raw);
  const fs::path film = folder / "film.mp4";
  const int status = run_program({"ffmpeg",
                                  "-nostdin",
                                  "-y",
                                  "-loglevel",
                                  "error",
                                  "-f",
                                  "rawvideo",
                                  "-pix_fmt",
                                  "bgr24",
                                  "-s",
                                  fmt::format("{}x{}", kWidth, kHeight),
                                  "-r",
                                  "25",
                                  "-i",
                                  (folder / "pictures.bgr").string(),
                                  "-c:v",
                                  "libx264",
                                  "-pix_fmt",
                                  "yuv420p",
                                  film.string()},
                                 {});
  if (status != 0) fail(fmt::format("ffmpeg ended with {}", status));
  cv::VideoCapture capture(film.string());
  cv::Mat decoded;
  int num = 0;
  for (; capture.read(decoded); ++num) {
    constexpr double kMaxOff = 8;  // of 255; libx264 at its defaults is off by 2
    const double off = std::abs(cv::mean(decoded)[0] - cv::mean(picture(std::min(num, kNumPictures - 1)))[0]);
    if (decoded.cols != kWidth || decoded.rows != kHeight || off > kMaxOff)
      fail(fmt::format("picture {} comes back {}x{} and off by {:.0f} of 255", num, decoded.cols, decoded.rows, off));
  }
  if (num != kNumPictures) fail(fmt::format("{} pictures go in, {} come out", kNumPictures, num));
}

void check_exr(const fs::path& folder) {
  Plane depth{.width = 17, .height = 9, .values = {}};
  for (int i = 0; i < depth.width * depth.height; ++i) depth.values.push_back(0.1F * static_cast<float>(i));
  write_exr(folder / "depth.exr", {{.view = "", .channels = {{"Z", depth}}, .half_channels = {}}});
  if (read_exr(folder / "depth.exr").at("Z").values != depth.values) fail("values differ after writing and reading");
}

struct Rosenbrock {
  template <class T>
  bool operator()(const T* x, T* residuals) const {
    residuals[0] = 10.0 * (x[1] - x[0] * x[0]);
    residuals[1] = 1.0 - x[0];
    return true;
  }
};

/// Rosenbrock's valley has its lowest point at (1, 1).
void check_solver(const fs::path&) {
  double x[2] = {-1.2, 1.0};
  ceres::Problem problem;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Rosenbrock, 2, 2>(new Rosenbrock), nullptr, x);
  ceres::Solver::Options options;
  options.max_num_iterations = 200;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (std::abs(x[0] - 1) > 1e-4 || std::abs(x[1] - 1) > 1e-4)
    fail(fmt::format("found ({}, {}) instead of (1, 1)", x[0], x[1]));
}

void check_colmap(const fs::path& folder) {
  const fs::path out = folder / "colmap.txt";
  const int status = run_program({"colmap", "-h"}, {.stdout_file = out, .stderr_file = folder / "colmap_errors.txt"});
  if (status != 0) fail(fmt::format("colmap -h ended with {}", status));
  if (read_file(out).find("COLMAP") == std::string::npos) fail("colmap -h does not say what it is");
}

}  // namespace

void check_disk(const fs::path& store) {
  constexpr std::size_t kNumBytes = 8U << 20U;
  const fs::path folder = store / ".tmp" / ("selftest." + to_hex(random_bytes(8)));
  fs::create_directories(folder);
  try {
    const std::string bytes = random_bytes(kNumBytes), hash = hash_bytes(bytes);
    write_file_atomically(folder / "bytes", bytes);
    fs::rename(folder / "bytes", folder / "renamed");
    if (hash_file(folder / "renamed") != hash) fail("what is read is not what was written");
  } catch (...) {
    std::error_code ignored;  // the first error tells more
    fs::remove_all(folder, ignored);
    throw;
  }
  fs::remove_all(folder);
}

const std::vector<MachineCheck>& machine_checks() {
  static const std::vector<MachineCheck> checks{
      {"film", check_film, {"ingest", "encode"}},
      {"exr", check_exr, {}},
      {"solver", check_solver, {}},
      {"colmap", check_colmap, {"calibrate", "fuse"}},
  };
  return checks;
}

}  // namespace vantage
