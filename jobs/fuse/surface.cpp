#include "jobs/fuse/surface.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <fstream>
#include <sstream>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/program.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// Number of elements of a kind that a PLY's header announces; 0 when there is no such file or element.
int ply_count(const fs::path& path, const std::string& element) {
  std::ifstream in(path);
  const std::string prefix = "element " + element + " ";
  for (std::string line; std::getline(in, line) && line != "end_header";)
    if (line.starts_with(prefix)) return std::stoi(line.substr(prefix.size()));
  return 0;
}

/// The mesher notes folders and timings in comments: without them equal input gives equal bytes.
void copy_without_comments(const fs::path& mesh, const fs::path& out) {
  const std::string data = read_file(mesh), end = "end_header\n";
  const std::size_t body = data.find(end) + end.size();
  std::istringstream header(data.substr(0, body));
  std::string kept;
  for (std::string line; std::getline(header, line);)
    if (!line.starts_with("comment")) kept += line + "\n";
  write_file_atomically(out, kept + data.substr(body));
}

template <class T>
void put(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void put_vertex(std::string& out, const Eigen::Vector3f& at, const Patch& p) {
  for (int i = 0; i < 3; ++i) put(out, at(i));
  for (int i = 0; i < 3; ++i) put(out, p.rgb(i));
}

}  // namespace

int write_poisson_surface(const fs::path& points_ply, const fs::path& out, const fs::path& scratch,
                          const SurfaceOptions& options) {
  constexpr int kFewestPoints = 1000;  // poisson_mesher crashes on an empty cloud and makes blobs of a sparse one
  if (ply_count(points_ply, "vertex") < kFewestPoints) return 0;
  const fs::path mesh = scratch / "poisson.ply";
  const int status =
      run_program({"colmap", "poisson_mesher", "--input_path", points_ply.string(), "--output_path", mesh.string(),
                   "--PoissonMeshing.depth", std::to_string(options.depth), "--PoissonMeshing.trim",
                   std::to_string(options.trim), "--PoissonMeshing.num_threads", "1"},
                  {.stdout_file = {}, .stderr_file = scratch / "poisson.log"});
  // The exit code says little: a missing input ends with 0, a crash leaves half a file. What counts is the mesh.
  const bool crashed = status >= 128;
  const int vertices = crashed ? 0 : ply_count(mesh, "vertex");
  if (vertices == 0 || ply_count(mesh, "face") == 0) return 0;
  copy_without_comments(mesh, out);
  return vertices;
}

void write_patch_squares(const fs::path& out, const std::vector<Patch>& patches, float time_s,
                         const PatchSpacing& spacing) {
  std::string text = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\nproperty list uchar int "
      "vertex_indices\nend_header\n",
      4 * patches.size(), 2 * patches.size());
  for (const Patch& p : patches) {
    const float half = static_cast<float>(0.5 * spacing(p));
    const Eigen::Vector3f a = half * p.normal.unitOrthogonal(), b = p.normal.cross(a), c = p.position_at(time_s);
    for (const Eigen::Vector3f& corner : {Eigen::Vector3f(c - a - b), Eigen::Vector3f(c + a - b),
                                          Eigen::Vector3f(c + a + b), Eigen::Vector3f(c - a + b)})
      put_vertex(text, corner, p);
  }
  for (int i = 0; i < static_cast<int>(patches.size()); ++i)
    for (const int third : {2, 3}) {
      put(text, static_cast<unsigned char>(3));
      for (const int corner : {0, third - 1, third}) put(text, 4 * i + corner);
    }
  write_file_atomically(out, text);
}

}  // namespace vantage
