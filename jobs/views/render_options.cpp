#include "jobs/views/render_options.h"

#include <cmath>
#include <cstdlib>
#include <optional>

#include "schema/base/error.h"

namespace vantage {
namespace {

std::optional<double> number(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// "-3:-2" in % behind the screen, as disparity before and after in % (positive in front).
std::pair<double, double> point_of(const std::string& text, const std::string& where) {
  const std::size_t colon = text.find(':');
  const auto from = number(text.substr(0, colon));
  const auto to = colon == std::string::npos ? std::nullopt : number(text.substr(colon + 1));
  if (!from || !to)
    throw Error(ErrorKind::BadInput, fmt::format("{}: is \"{}\", expected two numbers \"from:to\" in % of the width, "
                                                 "e.g. \"3:2\"",
                                                 where, text));
  return {-*from, -*to};
}

std::vector<std::pair<double, double>> points_of(const RenderOptions& options, const std::string& where) {
  std::vector<std::pair<double, double>> points;
  for (auto text = options.disparity_points.rbegin(); text != options.disparity_points.rend(); ++text)
    points.push_back(point_of(*text, where));
  for (std::size_t k = 1; k < points.size(); ++k)
    if (points[k].first <= points[k - 1].first || points[k].second < points[k - 1].second)
      throw Error(
          ErrorKind::BadInput,
          fmt::format("{}: \"{}\" comes before \"{}\", expected points that rise: what lies behind stays behind", where,
                      options.disparity_points[points.size() - 1 - k], options.disparity_points[points.size() - k]));
  if (options.disparity_map == "piecewise" && points.size() < 2)
    throw Error(ErrorKind::BadInput, fmt::format("{}: has {} points, disparity_map = \"piecewise\" needs two or more, "
                                                 "e.g. [\"-2:-1\", \"0:0\", \"6:2\"]",
                                                 where, points.size()));
  return points;
}

}  // namespace

RenderOptions render_options(const RenderRequest& request) {
  RenderOptions options = params_from_section<RenderOptions>(request.options);
  points_of(options, request.options.where("disparity_points"));
  return options;
}

DisparityMapping disparity_mapping(const RenderRequest& request, int width_px) {
  const RenderOptions options = render_options(request);
  return {.kind = request.mode == "stereo-depth" ? options.disparity_map : "linear",
          .width_px = static_cast<double>(width_px),
          .gain = request.mode == "stereo-depth" ? options.disparity_gain : 1,
          .offset_px = request.mode == "stereo-depth" ? options.disparity_offset_px : 0,
          .points_percent = points_of(options, request.options.where("disparity_points")),
          .strength = options.histogram_strength,
          .budget = {options.crossed_percent, options.uncrossed_percent}};
}

}  // namespace vantage
