#pragma once
#include <opencv2/core.hpp>

namespace vantage {

/// What stands before a screen of one colour. Linear light.
struct KeyedPicture {
  cv::Mat3f bgr;    ///< premultiplied by alpha, free of the screen's colour
  cv::Mat1f alpha;  ///< 0 screen … 1 foreground
};

/// Takes the screen out of a picture. With I = alpha F + (1 - alpha) B, three things are known of a pixel at an edge:
/// B, the screen's colour beside it (so that uneven light does no harm); that F has no negative channel, and none of
/// the key's colour above its other channels (both bound alpha); and about what F is, from the nearest pixel that is
/// surely foreground (alpha between its bounds is the projection of I - B onto F - B). Inside the foreground alpha is 1
/// and what the screen reflects onto it is held down to the other channels. key: a colour that is mostly green or
/// mostly blue. Fails, as every keyer does, for foregrounds of the key's colour and for screens in deep shadow (less
/// than about half the light of the rest).
KeyedPicture chroma_key(const cv::Mat3f& linear_bgr, const cv::Vec3f& key);

}  // namespace vantage
