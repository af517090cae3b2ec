#pragma once
#include <cstddef>
#include <vector>

namespace vantage {

/// A field of width x height values kept by the colours of a chess board, so that all of one colour can be updated
/// from the other with plain loops over neighbouring floats. Column x of row y has colour (x + y) & 1 and lies at index
/// x / 2. One cell of margin on every side.
class ChessBoard {
 public:
  ChessBoard(int width, int height)
      : stride_(static_cast<std::size_t>(width) / 2 + 3),
        values_(2 * stride_ * (static_cast<std::size_t>(height) + 2)) {}
  float* row(int colour, int y) { return values_.data() + offset(colour, y); }
  const float* row(int colour, int y) const { return values_.data() + offset(colour, y); }
  /// Parity of the columns of one colour in one row: they are 2 i + parity.
  static int parity(int colour, int y) { return (colour + y) & 1; }

 private:
  std::size_t offset(int colour, int y) const {
    return (2 * static_cast<std::size_t>(y + 1) + static_cast<std::size_t>(colour)) * stride_ + 1;
  }
  std::size_t stride_;
  std::vector<float> values_;
};

}  // namespace vantage
