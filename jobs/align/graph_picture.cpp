#include "jobs/align/graph_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace vantage::align {
namespace {

constexpr double kSide = 640, kRadius = 250;
/// More labels than this lie on each other; hovering still shows them.
constexpr std::size_t kMaxLabels = 15;

struct Point {
  double x = 0, y = 0;
};

Point place_of(std::size_t camera, std::size_t num_cameras) {
  const double angle = 2 * M_PI * static_cast<double>(camera) / static_cast<double>(num_cameras) - M_PI / 2;
  return {kSide / 2 + kRadius * std::cos(angle), kSide / 2 + kRadius * std::sin(angle)};
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

/// Line and label of one pair. residual: nullptr when the pair took no part.
std::string draw_pair(const PairOffset& pair, const PairResidual* residual, Point p, Point q, bool label) {
  const bool used = residual && !residual->rejected;
  const char* colour = used ? "#2a9d5c" : residual ? "#d1495b" : "#b8bcc4";
  const std::string title =
      fmt::format("{} – {}: {}{}", pair.a, pair.b, pair.verdict,
                  residual ? fmt::format("; the clocks leave {:+.2f} ms", 1e3 * residual->residual_s) : std::string());
  std::string out = fmt::format(
      R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="{}" stroke-width="{}"{}><title>{}</title></line>)",
      p.x, p.y, q.x, q.y, colour, used ? 2 : 1.2, residual ? "" : R"( stroke-dasharray="4 5")", escaped(title));
  if (label && residual)  // a third along, so that labels of lines that cross in the middle stay apart
    out +=
        fmt::format(R"(<text x="{:.1f}" y="{:.1f}" fill="{}" class="pair">{:+.1f} ± {:.1f} ms</text>)",
                    p.x + (q.x - p.x) * 0.36, p.y + (q.y - p.y) * 0.36, colour, 1e3 * pair.offset_s, 1e3 * pair.std_s);
  return out + "\n";
}

std::string draw_camera(const GraphCamera& camera, const CameraClock* clock, bool reference, Point at) {
  const std::string below = !clock ? "not tied"
                            : reference
                                ? "reference"
                                : fmt::format("{:+.1f} ± {:.1f} ms", 1e3 * clock->offset_s, 1e3 * clock->offset_std_s);
  return fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="9" fill="{}" stroke="#333" stroke-width="1.5"/>)", at.x,
                     at.y, clock ? "#f4c95d" : "none") +
         fmt::format(R"(<text x="{:.1f}" y="{:.1f}" class="camera">{}</text><text x="{:.1f}" y="{:.1f}">{}</text>)",
                     at.x, at.y - 15, escaped(camera.name), at.x, at.y + 25, below) +
         "\n";
}

}  // namespace

std::string graph_picture(const std::vector<GraphCamera>& cameras, const std::vector<PairOffset>& pairs,
                          const ClockSolution& solution) {
  std::string svg = fmt::format(
      R"(<svg xmlns="http://www.w3.org/2000/svg" width="{0}" height="{0}" viewBox="0 0 {0} {0}">
<style>text{{font:11px sans-serif;text-anchor:middle;fill:#333}}.camera{{font-weight:bold;font-size:13px}}
.pair{{font-size:10px;paint-order:stroke;stroke:#fff;stroke-width:3px}}</style><rect width="{0}" height="{0}" fill="#fff"/>
)",
      static_cast<int>(kSide));
  const auto place = [&](const std::string& name) {
    const auto at = std::find_if(cameras.begin(), cameras.end(), [&](const GraphCamera& c) { return c.name == name; });
    return place_of(static_cast<std::size_t>(at - cameras.begin()), cameras.size());
  };
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto residual = std::find_if(solution.residuals.begin(), solution.residuals.end(),
                                       [&](const PairResidual& r) { return r.pair == k; });
    svg += draw_pair(pairs[k], residual == solution.residuals.end() ? nullptr : &*residual, place(pairs[k].a),
                     place(pairs[k].b), pairs.size() <= kMaxLabels);
  }
  for (const GraphCamera& camera : cameras)
    svg += draw_camera(camera, solution.clocks.find(camera.name), camera.name == solution.clocks.reference,
                       place(camera.name));
  return svg + "</svg>\n";
}

}  // namespace vantage::align
