#include "scheduler/report/report.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>

#include "scheduler/report/html.h"
#include "scheduler/report/sections.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/formats/manifest.h"

namespace vantage {
namespace fs = std::filesystem;

namespace report {

std::vector<const ReportJob*> finished(const ReportInput& input, const std::string& kind) {
  std::vector<const ReportJob*> found;
  for (const auto& job : input.jobs)
    if (job.kind == kind && !job.artifact.empty()) found.push_back(&job);
  return found;
}

fs::path artifact_of(const ReportInput& input, const std::string& name) {
  const auto found =
      std::find_if(input.jobs.begin(), input.jobs.end(), [&](const auto& job) { return job.name == name; });
  return found == input.jobs.end() ? fs::path{} : found->artifact;
}

Json figures_of(const fs::path& artifact) {
  const auto manifest = artifact.empty() ? std::nullopt : read_valid_manifest(artifact);
  return manifest ? manifest->figures : Json::object();
}

std::vector<const ReportJob*> sample(const std::vector<const ReportJob*>& jobs, std::size_t count) {
  if (jobs.size() <= count) return jobs;
  std::vector<const ReportJob*> chosen;
  for (std::size_t i = 0; i < count; ++i)
    chosen.push_back(jobs[i * (jobs.size() - 1) / std::max<std::size_t>(1, count - 1)]);
  return chosen;
}

std::size_t camera_index(const ReportInput& input, const std::string& name) {
  const auto& cameras = input.shot.cameras;
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const auto& c) { return c.name == name; });
  return static_cast<std::size_t>(found - cameras.begin());
}

fs::path page_folder(const ReportInput& input) { return input.shot.folder / "out"; }

}  // namespace report

std::vector<JobWarning> warnings_of(const ReportInput& input) {
  std::vector<JobWarning> warnings;
  for (const auto& job : input.jobs) {
    const Json figures = report::figures_of(job.artifact);
    if (!figures.contains("warnings")) continue;
    for (const auto& sentence : figures.at("warnings")) warnings.push_back({job.name, sentence.get<std::string>()});
  }
  return warnings;
}

namespace {

constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --page:#f5f6f8; --card:#fff; --text:#171b22; --soft:#5d6879; --line:#dfe3e9; --accent:#0072b2; --bad:#c94b00; --warn:#946200 }
@media (prefers-color-scheme: dark) { :root { --page:#0e1116; --card:#171b22; --text:#e8ebf0; --soft:#98a2b3; --line:#2a303a; --accent:#56b4e9; --bad:#f0703a; --warn:#e6b03c } }
* { box-sizing: border-box }
body { margin: 0 auto; max-width: 1180px; padding: 32px 24px 80px; background: var(--page); color: var(--text); font: 15px/1.55 system-ui, "Segoe UI", "DejaVu Sans", sans-serif }
h1 { font-size: 32px; margin: 0 } h2 { font-size: 20px; margin: 0 0 12px } h3 { font-size: 15px; margin: 16px 0 6px; color: var(--soft) }
section { background: var(--card); border: 1px solid var(--line); border-radius: 12px; padding: 20px 22px; margin: 18px 0 }
.lead { color: var(--soft); margin: 4px 0 0 } .lead b { color: var(--text) }
.strip { display: flex; flex-wrap: wrap; gap: 14px } figure { margin: 0; max-width: 100% }
figure img { height: 150px; max-width: 100%; border-radius: 8px; display: block; background: var(--line) } .big img { height: 230px } .whole img { height: auto; width: 100% }
video { height: 260px; max-width: 100%; border-radius: 8px; display: block; background: #000 }
figcaption { font-size: 12.5px; color: var(--soft); padding-top: 3px }
.scroll { overflow-x: auto } table { border-collapse: collapse; font-variant-numeric: tabular-nums } th { text-align: left; color: var(--soft); font-size: 13px }
th, td { padding: 4px 18px 4px 0; border-bottom: 1px solid var(--line); white-space: nowrap } td.wrap { white-space: normal }
.two { display: grid; grid-template-columns: repeat(auto-fit, minmax(380px, 1fr)); gap: 22px; align-items: start }
svg { width: 100%; height: auto; display: block } svg text { fill: var(--soft); font: 11px system-ui, "DejaVu Sans", sans-serif } .axis { stroke: var(--line) } .grid { stroke: var(--line); stroke-width: .5 }
.bad { color: var(--bad) } .warn { color: var(--warn) } code { font: 12.5px ui-monospace, "DejaVu Sans Mono", monospace; overflow-wrap: anywhere; white-space: normal }
ul { margin: 0; padding-left: 20px }
)";

std::string local_time(std::int64_t ms) {
  const std::time_t seconds = static_cast<std::time_t>(ms / 1000);
  std::tm parts{};
  localtime_r(&seconds, &parts);
  return fmt::format("{:%Y-%m-%d %H:%M}", parts);
}

std::string lead(const ReportInput& input) {
  std::size_t num_finished = 0, num_failed = 0;
  for (const auto& job : input.jobs) {
    if (job.state == "done" || job.state == "skipped") ++num_finished;
    if (job.state == "failed" || job.state == "quarantined" || job.state == "aborted") ++num_failed;
  }
  const double wall_s = static_cast<double>(input.finished_ms.value_or(input.now_ms) - input.submitted_ms) / 1000;
  std::string text = fmt::format("<b>{}</b> · {} cameras · {} of {} jobs finished", html::escape(input.state),
                                 input.shot.cameras.size(), num_finished, input.jobs.size());
  if (num_failed > 0) text += fmt::format(" · <b class=\"bad\">{} failed</b>", num_failed);
  return text + fmt::format(" · {} · {}", html::duration(wall_s), local_time(input.submitted_ms));
}

/// A part that cannot be read must not take the others with it.
std::string guarded(const std::function<std::string(const ReportInput&)>& part, const ReportInput& input) {
  try {
    return part(input);
  } catch (const Error& e) {
    return fmt::format("<p class=\"bad\">Not shown: {}</p>\n", html::escape(e.what()));
  }
}

struct Part {
  const char* title;
  std::function<std::string(const ReportInput&)> html;
};

const std::vector<Part>& parts() {
  using namespace report;
  static const std::vector<Part> all{
      {"Failed jobs", failures},
      {"Films", films},
      {"Rendered frames", frames},
      {"Warnings", warnings},
      {"What went in", footage},
      {"Calibration", calibration},
      {"Clocks", clocks},
      {"Navigation space", navspace},
      {"Correspondence", correspondence},
      {"Depth", depth},
      {"Model", model},
      {"Where the time went", cost},
  };
  return all;
}

}  // namespace

std::string report_html(const ReportInput& input) {
  const std::string name = html::escape(input.shot.name);
  std::string page = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\">"
      "<title>{0} · Vantage</title><style>{1}</style></head><body>\n<h1>{0}</h1><p class=\"lead\">{2}</p>\n",
      name, kStyle, lead(input));
  if (!input.error.empty()) page += fmt::format("<p class=\"bad\">{}</p>\n", html::escape(input.error));
  for (const Part& part : parts()) page += html::section(part.title, guarded(part.html, input));
  return page + "</body></html>\n";
}

void write_report(const ReportInput& input) {
  fs::create_directories(report::page_folder(input));
  write_file_atomically(report::page_folder(input) / "report.html", report_html(input));
}

}  // namespace vantage
