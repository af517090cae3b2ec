#pragma once
#include <opencv2/core.hpp>

#include "jobs/correspond/flow_pair.h"

namespace vantage {

/// Unconstrained dense motion, coarse to fine down to full resolution (DIS, Kroeger et al. 2016, with variational
/// refinement). start: where the search begins; empty for none.
cv::Mat2f dis_flow(const cv::Mat1b& from, const cv::Mat1b& to, const cv::Mat2f& start);

/// Variational refinement (Brox et al. 2004) of a nearly right motion.
void refine_flow(const cv::Mat1b& from, const cv::Mat1b& to, cv::Mat2f& motion);

/// `other` with its gain and offset brought to those of `reference`, robustly: DIS and refinement compare grey values.
cv::Mat1b with_levels_of(const cv::Mat1b& reference, const cv::Mat1b& other);

}  // namespace vantage
