// What can be looked at: footage, films, flow, depth, frames, patches.
#include <fmt/format.h>

#include <algorithm>

#include "scheduler/report/html.h"
#include "scheduler/report/sections.h"
#include "schema/formats/frame_table.h"
#include "schema/formats/patches.h"

namespace vantage::report {
namespace fs = std::filesystem;
namespace {

std::string strip(const std::string& figures) {
  return figures.empty() ? figures : "<div class=\"strip\">" + figures + "</div>\n";
}

std::string short_name(const std::string& job) { return job.substr(job.find('/') + 1); }

std::vector<fs::path> files_below(const fs::path& folder, const std::string& ending) {
  std::vector<fs::path> found;
  if (!fs::is_directory(folder)) return found;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == ending && fs::is_regular_file(entry.path())) found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

std::string films(const ReportInput& input) {
  std::string out;
  for (const fs::path& film : files_below(page_folder(input) / "render", ".mp4")) {
    const std::string path = html::escape(film.lexically_relative(page_folder(input)).string());
    out += fmt::format(
        "<figure><video src=\"{0}\" controls loop muted preload=\"metadata\"></video><figcaption>"
        "<a href=\"{0}\">{0}</a></figcaption></figure>\n",
        path);
  }
  return strip(out);
}

std::string footage(const ReportInput& input) {
  std::vector<std::vector<std::string>> rows{{"camera", "footage", "frames", "size", "rate", "length"}};
  std::string thumbnails;
  for (const auto& camera : input.shot.cameras) {
    const fs::path artifact = artifact_of(input, "ingest/" + camera.name);
    const std::string name = html::escape(camera.name);
    if (artifact.empty()) {
      rows.push_back({name, html::escape(camera.footage), "not read yet", "", "", ""});
      continue;
    }
    const FrameTable table = read_frame_table(artifact);
    const double length_s = table.pts_s.empty() ? 0 : table.pts_s.back();
    rows.push_back({name, html::escape(camera.footage), std::to_string(table.num_frames()),
                    fmt::format("{} × {}", table.width, table.height), fmt::format("{:.3g} fps", table.fps),
                    fmt::format("{:.2f} s", length_s)});
    const fs::path preview = html::preview_of(artifact);
    if (!preview.empty()) thumbnails += html::picture(preview, page_folder(input), camera.name);
  }
  return html::table(rows) + "<p></p>" + strip(thumbnails);
}

std::string pictures(const ReportInput& input, const std::string& kind, std::size_t count) {
  const auto jobs = finished(input, kind);
  std::string out;
  for (const ReportJob* job : sample(jobs, count)) {
    const fs::path preview = html::preview_of(job->artifact);
    if (!preview.empty()) out += html::picture(preview, page_folder(input), short_name(job->name));
  }
  if (out.empty()) return {};
  return fmt::format("<p class=\"lead\">{} of {}</p>", std::min(count, jobs.size()), jobs.size()) + strip(out);
}

std::string model(const ReportInput& input) {
  const fs::path artifact = artifact_of(input, "fuse");
  if (artifact.empty()) return pictures(input, "reconstruct", 6);
  const auto patches = read_patches_ply(artifact / "patches.ply");
  std::string out =
      fmt::format("<p class=\"lead\"><b>{}</b> patches in <code>model/patches.ply</code></p>", patches.size());
  const fs::path preview = html::preview_of(artifact);
  if (!preview.empty())
    out += "<div class=\"big\">" + html::picture(preview, page_folder(input), "fused model") + "</div>";
  return out + pictures(input, "reconstruct", 6);
}

}  // namespace vantage::report
