#pragma once
#include <vector>

namespace vantage {

/// Smooth curve through points that rises and falls only where they do: cubic Hermite pieces with slopes after Fritsch
/// & Carlson, "Monotone piecewise cubic interpolation" (1980), in the harmonic form of Fritsch & Butland (1984).
/// Between equal values it stays exactly put, it never overshoots a point, two points make a straight line; before the
/// first and after the last point it is constant.
class MonotoneCubic {
 public:
  /// xs: rising, at least one; ys: as many.
  MonotoneCubic(std::vector<double> xs, std::vector<double> ys);
  double operator()(double x) const;

 private:
  double secant(std::size_t k) const;
  double slope(std::size_t k) const;

  std::vector<double> xs_, ys_;
};

}  // namespace vantage
