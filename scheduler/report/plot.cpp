#include "scheduler/report/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "scheduler/report/html.h"

namespace vantage::report {
namespace {

constexpr double kLeftPx = 52, kRightPx = 12, kTopPx = 10, kBottomPx = 38;

void widen(Plot::Axis& axis) {
  const double span = std::max(axis.max - axis.min, 1e-9 + 1e-3 * std::max(std::abs(axis.min), std::abs(axis.max)));
  axis.min -= 0.06 * span;
  axis.max += 0.06 * span;
}

void grow_to(Plot::Axis& axis, double span) {
  const double middle = (axis.min + axis.max) / 2;
  axis.min = middle - span / 2;
  axis.max = middle + span / 2;
}

/// 1, 2 or 5 times a power of ten, so that about `count` steps fill the span.
double tick_step(double span, int count) {
  const double power = std::pow(10.0, std::floor(std::log10(span / count)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (span / (factor * power) <= count) return factor * power;
  return 10 * power;
}

}  // namespace

Plot::Plot(Axis x, Axis y, bool equal_scale, int width_px, int height_px)
    : x_(std::move(x)), y_(std::move(y)), width_px_(width_px), height_px_(height_px) {
  widen(x_);
  widen(y_);
  if (!equal_scale) return;
  const double inner_width = width_px - kLeftPx - kRightPx, inner_height = height_px - kTopPx - kBottomPx;
  const double units_per_px = std::max((x_.max - x_.min) / inner_width, (y_.max - y_.min) / inner_height);
  grow_to(x_, units_per_px * inner_width);
  grow_to(y_, units_per_px * inner_height);
}

Eigen::Vector2d Plot::px(double x, double y) const {
  return {kLeftPx + (x - x_.min) / (x_.max - x_.min) * (width_px_ - kLeftPx - kRightPx),
          height_px_ - kBottomPx - (y - y_.min) / (y_.max - y_.min) * (height_px_ - kTopPx - kBottomPx)};
}

void Plot::dot(double x, double y, double radius_px, std::string_view colour, double opacity) {
  const auto p = px(x, y);
  body_ += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\" opacity=\"{}\"/>", p.x(), p.y(),
                       radius_px, colour, opacity);
}

void Plot::line(double x0, double y0, double x1, double y1, std::string_view colour, double width_px, double opacity) {
  const auto a = px(x0, y0), b = px(x1, y1);
  body_ += fmt::format("<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" stroke=\"{}\" stroke-width=\"{}\" opacity=\"{}\"/>",
                       a.x(), a.y(), b.x(), b.y(), colour, width_px, opacity);
}

void Plot::polyline(const std::vector<Eigen::Vector2d>& points, std::string_view colour, double width_px) {
  std::string path;
  for (const auto& point : points) {
    const auto p = px(point.x(), point.y());
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", p.x(), p.y());
  }
  body_ += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\"/>",
                       path, colour, width_px);
}

void Plot::text(double x, double y, std::string_view words, double dx_px, double dy_px) {
  const auto p = px(x, y);
  body_ += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>", p.x() + dx_px, p.y() + dy_px, html::escape(words));
}

std::string Plot::axes() const {
  std::string out;
  const double step_x = tick_step(x_.max - x_.min, 8), step_y = tick_step(y_.max - y_.min, 6);
  for (double x = std::ceil(x_.min / step_x) * step_x; x <= x_.max; x += step_x) {
    const auto p = px(x, y_.min);
    out += fmt::format(
        "<path class=\"grid\" d=\"M{0:.1f} {1}V{2}\"/><text x=\"{0:.1f}\" y=\"{3}\" "
        "text-anchor=\"middle\">{4:.4g}</text>",
        p.x(), p.y(), kTopPx, p.y() + 14, std::abs(x) < step_x / 1e6 ? 0 : x);
  }
  for (double y = std::ceil(y_.min / step_y) * step_y; y <= y_.max; y += step_y) {
    const auto p = px(x_.min, y);
    out += fmt::format(
        "<path class=\"grid\" d=\"M{0} {1:.1f}H{2}\"/><text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:.4g}</text>",
        p.x(), p.y(), width_px_ - kRightPx, p.x() - 5, p.y() + 4, std::abs(y) < step_y / 1e6 ? 0 : y);
  }
  out += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>", width_px_ - kRightPx, height_px_ - 6,
                     html::escape(x_.label));
  return out + fmt::format("<text transform=\"translate(12 {}) rotate(-90)\" text-anchor=\"end\">{}</text>", kTopPx,
                           html::escape(y_.label));
}

std::string Plot::svg() const {
  return fmt::format("<svg viewBox=\"0 0 {} {}\" role=\"img\">{}{}</svg>\n", width_px_, height_px_, axes(), body_);
}

std::string colour_of(std::size_t index) {
  static constexpr std::array<const char*, 8> kOkabeIto = {"#0072b2", "#e69f00", "#009e73", "#cc79a7",
                                                           "#d55e00", "#56b4e9", "#b8a800", "#888888"};
  if (index < kOkabeIto.size()) return kOkabeIto[index];
  return fmt::format("hsl({} 60% 50%)", (index * 137) % 360);  // the golden angle keeps neighbours apart
}

}  // namespace vantage::report
