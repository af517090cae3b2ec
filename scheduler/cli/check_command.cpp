#include <fmt/format.h>

#include "scheduler/cli/commands.h"
#include "scheduler/cli/parse.h"
#include "scheduler/cli/shot_facts.h"
#include "scheduler/report/html.h"
#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace {

Json to_json(const Shot& shot, const std::vector<FootageFacts>& footage, const std::vector<StageEstimate>& plan) {
  Json cameras = Json::array(), stages = Json::array();
  for (const auto& f : footage)
    cameras.push_back({{"name", f.camera},
                       {"footage", f.footage},
                       {"width", f.width},
                       {"height", f.height},
                       {"fps", f.fps},
                       {"num_frames", f.num_frames},
                       {"duration_s", f.duration_s},
                       {"warnings", f.warnings},
                       {"error", f.error}});
  for (const auto& stage : plan)
    stages.push_back({{"kind", stage.kind}, {"num_jobs", stage.num_jobs}, {"cpu_s", stage.cpu_s}});
  return {{"name", shot.name},
          {"folder", shot.folder.string()},
          {"cameras", cameras},
          {"plan", stages},
          {"free_disk_mb", free_disk_mb(shot.folder)}};
}

void print_footage(const std::vector<FootageFacts>& footage) {
  for (const auto& f : footage) {
    if (f.error.empty())
      fmt::print("  {:<12} {} x {}, {} frames, {:.4g} fps, {:.2f} s  {}\n", f.camera, f.width, f.height, f.num_frames,
                 f.fps, f.duration_s, f.footage);
    for (const auto& warning : f.warnings) fmt::print("  {:<12} warning: {}\n", "", warning);
  }
}

void print_plan(const std::vector<StageEstimate>& plan) {
  fmt::print("\n  {:<12} {:>10}  {:>14}\n", "stage", "jobs", "work (1 core)");
  double total_s = 0;
  for (const auto& stage : plan) {
    fmt::print("  {:<12} {:>10}  {:>14}\n", stage.kind, fmt::format("~{:.0f}", stage.num_jobs),
               "~" + html::duration(stage.cpu_s));
    total_s += stage.cpu_s;
  }
  fmt::print("  {:<12} {:>10}  {:>14}\n", "together", "", "~" + html::duration(total_s));
}

}  // namespace

int check_command(const Arguments& arguments) {
  CLI::App app{"Validates SHOT/shot.toml and its footage and shows the plan. Changes nothing.", "vantage check"};
  std::string folder;
  bool json = false;
  app.add_option("shot", folder, "folder of the shot")->required();
  app.add_flag("--json", json, "for programs");
  parse(app, arguments);

  const Shot shot = read_checked_shot(folder);
  const auto footage = probe_shot(shot);
  if (!json) {
    fmt::print("{}: {} cameras, {} renders\n", shot.name, shot.cameras.size(), shot.renders.size());
    print_footage(footage);
    std::fflush(stdout);
  }
  require_usable(footage);
  const auto plan = estimate_plan(shot, footage);
  if (json) {
    fmt::print("{}\n", to_json(shot, footage, plan).dump());
    return kExitOk;
  }
  print_plan(plan);
  fmt::print("\n{} MB free on the disk. Next: vantage run {}\n", free_disk_mb(shot.folder), folder);
  return kExitOk;
}

}  // namespace vantage
