#pragma once
#include <opencv2/core.hpp>

#include "jobs/correspond/variational_flow.h"

namespace vantage {

/// Motion found from a blurred, small picture upwards, each level starting from the one above: to a fraction of a
/// pixel, but things that move farther than they are wide are missed. Grey levels 0–255 of two pictures of one size.
cv::Mat2f coarse_to_fine_flow(const cv::Mat1f& from, const cv::Mat1f& to, const VariationalOptions& options);

/// A motion field at another size; its vectors grow with the picture.
cv::Mat2f resized_motion(const cv::Mat2f& motion, cv::Size size);

}  // namespace vantage
