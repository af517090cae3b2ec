// Clocks: when the cameras filmed, and what each pair of them had to say about it.
#include <fmt/format.h>

#include "scheduler/report/html.h"
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
  return "<div class=\"two\"><div>" + out + "</div><div class=\"whole\">" +
         html::picture(html::preview_of(artifact), page_folder(input), "offset and certainty of every pair") +
         "</div></div><h3>Pairs</h3>" + pair_table(pairs) + pair_pictures(input);
}

}  // namespace vantage::report
