#pragma once
#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

namespace vantage::report {

/// A plot in SVG with two axes. Data units in, pixels out; y grows upwards unless flipped by the caller's range.
class Plot {
 public:
  struct Axis {
    double min = 0, max = 1;
    std::string label;
  };
  /// Ranges are widened a little so that nothing sits on the rim. equal_scale: one unit is as long on both axes.
  Plot(Axis x, Axis y, bool equal_scale, int width_px = 560, int height_px = 340);

  void dot(double x, double y, double radius_px, std::string_view colour, double opacity = 1);
  void line(double x0, double y0, double x1, double y1, std::string_view colour, double width_px, double opacity = 1);
  void polyline(const std::vector<Eigen::Vector2d>& points, std::string_view colour, double width_px);
  void text(double x, double y, std::string_view words, double dx_px = 0, double dy_px = 0);
  bool holds(double x, double y) const { return x >= x_.min && x <= x_.max && y >= y_.min && y <= y_.max; }
  /// "<svg …>…</svg>"
  std::string svg() const;

 private:
  Eigen::Vector2d px(double x, double y) const;
  std::string axes() const;

  Axis x_, y_;
  int width_px_, height_px_;
  std::string body_;
};

/// A colour per camera, told apart as well as that many can be; the first eight are safe for all colour vision.
std::string colour_of(std::size_t index);

}  // namespace vantage::report
