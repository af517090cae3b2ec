#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "jobs/navspace/build_navspace.h"
#include "jobs/navspace/navspace_job.h"
#include "jobs/navspace/navspace_picture.h"
#include "jobs/navspace/sphere_frame.h"
#include "jobs/views/sphere.h"
#include "jobs/vision/shot_images.h"
#include "schema/base/error.h"
#include "schema/formats/clocks.h"
#include "schema/formats/frame_table.h"

namespace vantage {
namespace {

/// Every image that has a pose and a time, camera by camera, in order of frames.
std::vector<NavVertex> timed_images(JobContext& context, const Calibration& calibration, const Clocks& clocks) {
  std::map<std::string, FrameTable> tables;
  std::vector<NavVertex> vertices;
  for (const auto& [image, pose] : calibration.cam_from_world) {
    const CameraClock* clock = clocks.find(image.camera);
    if (clock == nullptr) continue;
    if (!context.has_input("ingest/" + image.camera))
      throw Error(ErrorKind::BadInput,
                  fmt::format("calibration has images of '{}', which is no camera of the shot", image.camera));
    if (!tables.contains(image.camera))
      tables[image.camera] = read_frame_table(context.input("ingest/" + image.camera));
    const FrameTable& table = tables[image.camera];
    if (image.frame >= table.num_frames()) continue;
    vertices.push_back({image, 0, 0, clock->shot_time_s(table.pts_s[static_cast<std::size_t>(image.frame)])});
  }
  return vertices;
}

void place_on_sphere(Navspace& navspace, const Calibration& calibration) {
  std::vector<std::vector<RigidTransform>> poses;
  for (std::size_t v = 0; v < navspace.vertices.size(); ++v) {
    const ImageId& image = navspace.vertices[v].image;
    if (v == 0 || image.camera != navspace.vertices[v - 1].image.camera) poses.emplace_back();
    poses.back().push_back(calibration.pose(image));
  }
  if (poses.empty()) return;
  const SphereFrame frame = sphere_frame(poses, calibration.points);
  navspace.centre = frame.centre;
  navspace.axes = frame.axes;
  navspace.radius = frame.radius;
  for (NavVertex& v : navspace.vertices) {
    const SpherePoint p = sphere_point(navspace, calibration.pose(v.image).centre());
    v.azimuth_deg = p.azimuth_deg;
    v.elevation_deg = p.elevation_deg;
  }
}

void tell(JobContext& context, const Navspace& navspace, const NavspaceReport& report) {
  context.figure("vertices", navspace.vertices.size());
  context.figure("simplices", navspace.simplices.size());
  context.figure("edges", navspace.edges.size());
  context.figure("shape", std::string(report.ring ? "ring, " : "") + (report.arc ? "arc" : "surface") +
                              (report.frozen ? ", one moment" : ", time"));
  context.figure("cells", report.cells);
  context.figure("radius", navspace.radius);
  if (report.crossing)
    context.warn("cameras moved past each other: the space is a Delaunay triangulation of all images, with more edges");
  if (report.num_unused > 0)
    context.warn(fmt::format("{} images lie in no cell of the navigation space", report.num_unused));
}

}  // namespace

void NavspaceJob::run(JobContext& context, const Params& params) {
  const Calibration calibration = read_calibration(context.input("calibrate"));
  const Clocks clocks = read_clocks(context.input("align"));
  Navspace navspace;
  navspace.vertices = timed_images(context, calibration, clocks);
  context.progress(0.2, "sphere");
  place_on_sphere(navspace, calibration);
  context.progress(0.4, "cells");
  const NavspaceReport report = join_vertices(navspace, {.cells = params.cells, .arc_ratio = params.arc_ratio});
  tell(context, navspace, report);
  write_navspace(context.out("navspace.json"), navspace);
  write_picture(context.out("preview.jpg"), navspace_picture(navspace));
}

}  // namespace vantage
