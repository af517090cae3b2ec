#include "worker/export_command.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <vector>

#include "jobs/depth/depth_mesh.h"
#include "jobs/depth/depth_points.h"
#include "jobs/vision/shot_images.h"
#include "schema/base/error.h"
#include "schema/formats/job_file.h"
#include "schema/formats/navspace.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

fs::path depth_file(const fs::path& shot, const ImageId& image) {
  return shot / "out/depth" / image.camera / fmt::format("{:06d}.exr", image.frame);
}

/// The depth map, and picture and pose from what its job read.
PosedDepth read_posed_depth(const fs::path& shot, const ImageId& image) {
  const fs::path depth = depth_file(shot, image), spec = shot / ".vantage/specs/depth" / (image.label() + ".json");
  for (const fs::path& file : {depth, spec})
    if (!fs::exists(file))
      throw Error(ErrorKind::BadInput,
                  fmt::format("{}: not there; depth of {} comes from a finished 'vantage run {}' with [depth] in "
                              "shot.toml, in the folder where it ran",
                              file.string(), image.label(), shot.string()));
  const JobFile job = read_job_file(spec);
  JobContext::Config config;
  for (const auto& [name, input] : job.inputs) config.inputs[name] = input.folder;
  const JobContext context(config);
  ShotImages images(context);
  return {images.pinhole(image), images.cam_from_world(image), read_depth(depth), images.bgr(image)};
}

/// Of every camera that has depth maps, the image nearest in time.
std::vector<ImageId> images_at(const fs::path& shot, double time_s) {
  if (!fs::exists(shot / "out/navspace.json"))
    throw Error(ErrorKind::BadInput, fmt::format("{}: not there; is {} a shot that has been run?",
                                                 (shot / "out/navspace.json").string(), shot.string()));
  const Navspace navspace = read_navspace(shot / "out");
  std::map<std::string, const NavVertex*> nearest;
  for (const NavVertex& v : navspace.vertices) {
    if (!fs::exists(depth_file(shot, v.image))) continue;
    const NavVertex*& best = nearest[v.image.camera];
    if (best == nullptr || std::abs(v.time_s - time_s) < std::abs(best->time_s - time_s)) best = &v;
  }
  std::vector<ImageId> images;
  for (const auto& [camera, vertex] : nearest) images.push_back(vertex->image);
  return images;
}

int export_points(const ExportOptions& options) {
  std::vector<PosedDepth> images;
  for (const ImageId& image : images_at(options.shot, options.time_s))
    images.push_back(read_posed_depth(options.shot, image));
  const std::vector<Patch> points = consistent_points(images, {.min_confidence = options.min_confidence});
  if (points.empty())
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: {} depth maps near {} s, and no point that two cameras agree on; needs [depth] in "
                            "shot.toml and cameras that see the same things",
                            options.shot.string(), images.size(), options.time_s));
  write_points_ply(options.to, points, 0);
  fmt::print("{}: {} points that two or more of {} cameras agree on\n", options.to.string(), points.size(),
             images.size());
  return 0;
}

int export_mesh(const ExportOptions& options) {
  const auto image = ImageId::parse(options.image);
  if (!image)
    throw Error(ErrorKind::BadInput,
                fmt::format("--image {}: is no image; one is written like cam0-000003", options.image));
  const PosedDepth posed = read_posed_depth(options.shot, *image);
  const DepthMesh mesh = mesh_of_depth(posed, options.min_confidence);
  if (mesh.triangles.empty())
    throw Error(ErrorKind::BadInput, fmt::format("{}: depth is known nowhere with a confidence of {} or more",
                                                 options.image, options.min_confidence));
  const bool obj = options.to.extension() == ".obj";
  obj ? write_mesh_obj(options.to, mesh, posed.bgr) : write_mesh_ply(options.to, mesh, posed.bgr);
  fmt::print("{}: {} vertices, {} triangles\n", options.to.string(), mesh.vertices.size(), mesh.triangles.size());
  return 0;
}

}  // namespace

int run_export_command(const ExportOptions& options) {
  const std::string suffix = options.to.extension().string();
  if (suffix != ".ply" && (options.image.empty() || suffix != ".obj"))
    throw Error(ErrorKind::BadInput,
                fmt::format("--to {}: ends in {}", options.to.string(),
                            options.image.empty() ? ".ply for points" : ".ply or .obj for a mesh"));
  return options.image.empty() ? export_points(options) : export_mesh(options);
}

}  // namespace vantage
