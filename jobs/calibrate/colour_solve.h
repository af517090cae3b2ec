#pragma once
#include <string>
#include <vector>

#include "jobs/calibrate/colour_samples.h"
#include "schema/formats/colour.h"

namespace vantage {

/// Gains and gammas that make samples of two cameras agree: for channel k of a sample
///   gamma_a log(L_a,k / 0.18) + log gain_a,k  =  gamma_b log(L_b,k / 0.18) + log gain_b,k,
/// weighted by how well a level tells its logarithm, least squares with Huber's weights (IRLS). The shared look is the
/// cameras' geometric mean: logarithms of gains and gammas - 1 have mean 0. Gammas stay 1 unless some of them matter.
/// Cameras with fewer than kFewSamples samples, or that samples do not tie to the largest group, stay as they are.
constexpr int kFewSamples = 50;
struct ColourSolution {
  std::vector<CameraColour> colours;  ///< by camera index; names empty
  std::vector<double> gain_std;       ///< of log gain, the worst channel, by camera
  std::vector<double> gamma_std;
  std::vector<int> num_samples;  ///< by camera
  double residual = 0;           ///< robust standard deviation of the differences of logarithms that are left

  bool is_compared(std::size_t camera) const { return num_samples[camera] > 0; }
  /// Some camera differs by more than 2 % in linear light (1 % of a level) or 0.05 in gamma, and by more than three
  /// standard deviations: worth changing pictures for.
  bool is_significant() const;
};
ColourSolution solve_colours(const std::vector<ColourSample>& samples, int num_cameras);

}  // namespace vantage
