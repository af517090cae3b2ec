// Correspondences, depth and frames: how much of the pictures is known, where it is worst, and what that looks like.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "scheduler/report/html.h"
#include "scheduler/report/sections.h"
#include "schema/base/median.h"
#include "schema/formats/camera.h"

namespace vantage::report {
namespace {

/// A job with the figure that it is judged by, percent.
struct Judged {
  const ReportJob* job = nullptr;
  std::string group;  ///< the row of the table that it belongs to
  double percent = 0;
  Json figures;
};

std::optional<Judged> judge(const ReportJob* job, const std::string& group, const char* figure) {
  Json figures = figures_of(job->artifact);
  if (!figures.contains(figure)) return std::nullopt;
  const double percent = figures.at(figure).get<double>();
  return Judged{job, group, percent, std::move(figures)};
}

std::string short_name(const ReportJob& job) { return job.name.substr(job.name.find('/') + 1); }

/// "cam0 – cam1" of an edge's name, "cam0, in time" of two frames of one camera.
std::string cameras_of_edge(const ReportJob& job) {
  const std::string name = short_name(job);
  const auto middle = name.find("__");
  if (middle == std::string::npos) return name;
  const auto first = ImageId::parse(name.substr(0, middle)), second = ImageId::parse(name.substr(middle + 2));
  if (!first || !second) return name;
  if (first->camera == second->camera) return first->camera + ", in time";
  return std::min(first->camera, second->camera) + " – " + std::max(first->camera, second->camera);
}

std::string camera_of_image(const ReportJob& job) {
  const auto image = ImageId::parse(short_name(job));
  return image ? image->camera : short_name(job);
}

/// "freeze" of "render/freeze/000012".
std::string render_of_frame(const ReportJob& job) {
  const std::string name = short_name(job);
  return name.substr(0, name.find('/'));
}

double median_of(const std::vector<const Judged*>& jobs, const char* figure) {
  std::vector<double> values;
  for (const Judged* j : jobs)
    if (j->figures.contains(figure)) values.push_back(j->figures.at(figure).get<double>());
  return values.empty() ? -1 : median(std::move(values));
}

struct Column {
  const char* title;
  const char* figure;
  const char* format;
};

/// A row per group: number of jobs, lowest percentage, medians of the columns' figures.
std::string table_of(const std::vector<Judged>& jobs, const char* group_title, const std::vector<Column>& columns) {
  std::map<std::string, std::vector<const Judged*>> groups;
  for (const Judged& j : jobs) groups[j.group].push_back(&j);
  std::vector<std::vector<std::string>> rows{{group_title, "maps", "lowest"}};
  for (const Column& column : columns) rows[0].emplace_back(column.title);
  for (const auto& [group, members] : groups) {
    const auto lowest =
        std::ranges::min_element(members, [](const Judged* a, const Judged* b) { return a->percent < b->percent; });
    rows.push_back({html::escape(group), std::to_string(members.size()), fmt::format("{:.1f} %", (*lowest)->percent)});
    for (const Column& column : columns) {
      const double value = median_of(members, column.figure);
      rows.back().push_back(value < 0 ? "" : fmt::format(fmt::runtime(column.format), value));
    }
  }
  return html::table(rows) + "<p></p>";
}

/// Full-width pictures of the lowest and the middle one.
std::string lowest_and_middle(const ReportInput& input, std::vector<Judged> jobs, const char* what) {
  if (jobs.empty()) return {};
  std::ranges::stable_sort(jobs, {}, &Judged::percent);
  std::vector<std::pair<const char*, const Judged*>> shown{{"lowest", &jobs.front()}};
  if (jobs.size() > 2) shown.emplace_back("middle", &jobs[jobs.size() / 2]);
  std::string out;
  for (const auto& [rank, j] : shown) {
    const auto preview = html::preview_of(j->job->artifact);
    if (preview.empty()) continue;
    out += "<div class=\"whole\">" +
           html::picture(preview, page_folder(input),
                         fmt::format("{}: {} {:.1f} % ({})", short_name(*j->job), what, j->percent, rank)) +
           "</div>";
  }
  return out;
}

std::vector<Judged> judged(const ReportInput& input, const char* kind, std::string (*group_of)(const ReportJob&),
                           const char* figure) {
  std::vector<Judged> jobs;
  for (const ReportJob* job : finished(input, kind))
    if (auto j = judge(job, group_of(*job), figure)) jobs.push_back(std::move(*j));
  return jobs;
}

}  // namespace

std::string correspondence(const ReportInput& input) {
  const std::vector<Judged> jobs = judged(input, "correspond", cameras_of_edge, "consistent_percent");
  if (jobs.empty()) return {};
  std::vector<Judged> across, in_time;
  for (const Judged& j : jobs) (j.group.ends_with(", in time") ? in_time : across).push_back(j);
  return "<p class=\"lead\">Share of a picture whose matches lead there and back again; the rest is hidden, outside, "
         "or "
         "not found.</p>" +
         table_of(jobs, "cameras",
                  {{"consistent, median", "consistent_percent", "{:.1f} %"},
                   {"off the epipolar line, median", "epipolar_residual_median_px", "{:.3f} px"}}) +
         lowest_and_middle(input, across, "consistent") + lowest_and_middle(input, in_time, "consistent");
}

std::string depth(const ReportInput& input) {
  const std::vector<Judged> jobs = judged(input, "depth", camera_of_image, "known_percent");
  if (jobs.empty()) return {};
  return "<p class=\"lead\">Share of a picture with depth, and with depth that two or more other pictures agree "
         "on.</p>" +
         table_of(jobs, "camera",
                  {{"known, median", "known_percent", "{:.1f} %"},
                   {"agreed, median", "agreed_percent", "{:.1f} %"},
                   {"frames, median", "frames", "{:.0f}"}}) +
         lowest_and_middle(input, jobs, "known");
}

std::string frames(const ReportInput& input) {
  std::vector<Judged> jobs = judged(input, "render", render_of_frame, "holes_percent");
  if (jobs.empty()) return {};
  for (Judged& j : jobs) j.percent = 100 - j.percent;
  std::string out =
      "<p class=\"lead\">Share of a frame that the footage shows; the rest, holes, is filled in and marked.</p>" +
      table_of(jobs, "render",
               {{"holes, median", "holes_percent", "{:.2f} %"}, {"images, median", "images", "{:.0f}"}});
  std::map<std::string, std::vector<Judged>> renders;
  for (const Judged& j : jobs) renders[j.group].push_back(j);
  for (const auto& [name, members] : renders) {
    out += lowest_and_middle(input, members, "seen");
    const auto chart = artifact_of(input, "encode/" + name) / "depth_budget.png";
    if (std::filesystem::exists(chart))
      out += "<div class=\"whole\">" + html::picture(chart, page_folder(input), name + ": depth budget") + "</div>";
  }
  return out;
}

}  // namespace vantage::report
