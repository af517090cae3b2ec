#pragma once
#include <opencv2/core.hpp>
#include <string>

namespace vantage {

/// Two eyes as one picture. layout: "side_by_side" (left eye on the left), "over_under" (left eye above), either with
/// "_half" (squeezed into the size of one eye), "anaglyph", "left", "right". left, right: BGR sRGB of one size, 8 or
/// 16 bit.
cv::Mat lay_out(const cv::Mat& left, const cv::Mat& right, const std::string& layout);

/// H.264's code for a layout; 0: none.
int frame_packing(const std::string& layout);

/// Red–cyan picture of two eyes: least-squares matrix of Dubois, "A projection method to generate anaglyph stereo
/// images", ICASSP 2001, in linear light. left, right: 8- or 16-bit BGR sRGB of one size.
cv::Mat anaglyph(const cv::Mat& left, const cv::Mat& right);

}  // namespace vantage
