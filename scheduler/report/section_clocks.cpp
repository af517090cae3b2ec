// Clocks: when the cameras filmed, and what each pair of them had to say about it.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "scheduler/report/html.h"
#include "scheduler/report/plot.h"
#include "scheduler/report/sections.h"
#include "schema/formats/clocks.h"

namespace vantage::report {
namespace {

std::vector<PairOffset> pairs_of(const ReportInput& input) {
  std::vector<PairOffset> pairs;
  for (const ReportJob* job : finished(input, "sync")) pairs.push_back(read_pair_offset(job->artifact));
  return pairs;
}

std::string clock_table(const ReportInput& input, const Clocks& clocks) {
  std::vector<std::vector<std::string>> rows{{"camera", "starts at", "±", "rate"}};
  for (const auto& camera : input.shot.cameras) {
    const CameraClock* clock = clocks.find(camera.name);
    const std::string name = html::escape(camera.name) + (camera.name == clocks.reference ? " (reference)" : "");
    if (clock == nullptr)
      rows.push_back({name, "<span class=\"bad\">could not be tied to the others</span>", "", ""});
    else
      rows.push_back({name, fmt::format("{:+.4f} s", clock->offset_s),
                      fmt::format("{:.1f} ms", 1000 * clock->offset_std_s), fmt::format("{:.6f}", clock->rate)});
  }
  return html::table(rows);
}

/// Cameras on a circle, a line for every pair that was looked at: the surer its offset the thicker; dashed where none
/// could be told. The offset ± its standard deviation stands on the line, or beside the pointer where lines are many.
class PairGraph {
 public:
  explicit PairGraph(const ReportInput& input) {
    const std::size_t num = input.shot.cameras.size();
    for (std::size_t i = 0; i < num; ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(num);
      places_[input.shot.cameras[i].name] = {kMiddlePx + kRadiusPx * std::sin(angle),
                                             kMiddlePx - kRadiusPx * std::cos(angle)};
      const auto& p = places_.at(input.shot.cameras[i].name);
      nodes_ += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"8\" fill=\"{}\"/>", p.x(), p.y(), colour_of(i));
      const double out = (kRadiusPx + 24) / kRadiusPx;
      nodes_ += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>",
                            kMiddlePx + out * (p.x() - kMiddlePx), kMiddlePx + out * (p.y() - kMiddlePx) + 4,
                            html::escape(input.shot.cameras[i].name));
    }
  }

  void add(const PairOffset& pair, bool labelled) {
    if (!places_.contains(pair.a) || !places_.contains(pair.b)) return;
    const Eigen::Vector2d &a = places_.at(pair.a), &b = places_.at(pair.b);
    const double width_px = std::clamp(3 / (1 + 0.5 * 1000 * pair.std_s), 0.6, 3.0);
    const std::string offset = fmt::format("{:+.1f} ± {:.1f} ms", 1000 * pair.offset_s, 1000 * pair.std_s);
    const std::string style = pair.determined
                                  ? fmt::format("stroke=\"var(--accent)\" stroke-width=\"{:.2f}\"", width_px)
                                  : "stroke=\"var(--warn)\" stroke-width=\"0.8\" stroke-dasharray=\"4 4\"";
    edges_ += fmt::format("<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" {}><title>{} – {}: {}</title></path>", a.x(), a.y(),
                          b.x(), b.y(), style, html::escape(pair.a), html::escape(pair.b),
                          pair.determined ? offset : html::escape(pair.verdict));
    if (!labelled || !pair.determined) return;
    const Eigen::Vector2d at = a + 0.42 * (b - a);  // off the middle, where the lines of a ring meet
    edges_ +=
        fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>", at.x(), at.y() - 3, offset);
  }

  std::string svg() const {
    return fmt::format("<svg viewBox=\"0 0 {0} {0}\" role=\"img\" style=\"max-width:560px\">{1}{2}</svg>\n",
                       2 * kMiddlePx, edges_, nodes_);
  }

 private:
  static constexpr double kMiddlePx = 220, kRadiusPx = 170;
  std::map<std::string, Eigen::Vector2d> places_;
  std::string edges_, nodes_;
};

std::string pair_graph(const ReportInput& input, const std::vector<PairOffset>& pairs) {
  constexpr std::size_t kMaxLabels = 10;
  PairGraph graph(input);
  for (const PairOffset& pair : pairs) graph.add(pair, pairs.size() <= kMaxLabels);
  return graph.svg();
}

std::string pair_table(const std::vector<PairOffset>& pairs) {
  std::vector<std::vector<std::string>> rows{{"pair", "offset", "±", "method", "verdict"}};
  for (const PairOffset& pair : pairs)
    rows.push_back(
        {html::escape(pair.a + " – " + pair.b),
         pair.determined ? fmt::format("{:+.4f} s", pair.offset_s) : "<span class=\"warn\">undetermined</span>",
         fmt::format("{:.1f} ms", 1000 * pair.std_s), html::escape(pair.method), html::escape(pair.verdict)});
  return html::table(rows);
}

/// What the surest pairs saw: matched tracks over both cameras, and how far they are from their epipolar lines.
std::string pair_pictures(const ReportInput& input) {
  constexpr std::size_t kMaxPairs = 4;
  std::string out;
  for (const ReportJob* job : sample(finished(input, "sync"), kMaxPairs))
    for (const char* name : {"matches.jpg", "residuals.png", "preview.jpg"})
      out += html::picture(job->artifact / name, page_folder(input), job->name);
  return out.empty() ? out : "<div class=\"strip\">" + out + "</div>";
}

}  // namespace

std::string clocks(const ReportInput& input) {
  const auto artifact = artifact_of(input, "align");
  const std::vector<PairOffset> pairs = pairs_of(input);
  if (artifact.empty() && pairs.empty()) return {};
  std::string out = artifact.empty() ? "" : clock_table(input, read_clocks(artifact));
  if (pairs.empty()) return out;
  return "<div class=\"two\"><div>" + out + "</div>" + pair_graph(input, pairs) + "</div><h3>Pairs</h3>" +
         pair_table(pairs) + pair_pictures(input);
}

}  // namespace vantage::report
