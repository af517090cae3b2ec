#include "jobs/correspond/patch_match.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "jobs/correspond/descriptor_field.h"

namespace vantage {
namespace {

constexpr int kMinSide_px = 24;
/// How far the finest level may correct what comes from above; coarser ones may jump anywhere, since what is small and
/// far away is not there yet at the coarsest.
constexpr int kCorrection_px = 6;
/// Random steps tried at each longer reach: a disc of 24 px radius that nothing leads to is then found every time.
constexpr int kFarDraws = 3;

std::uint32_t hashed(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  std::uint32_t h = a * 0x9E3779B1U ^ (b + 0x7F4A7C15U) * 0x85EBCA77U ^ (c + 0x165667B1U) * 0xC2B2AE3DU;
  h ^= h >> 15;
  h *= 0x2C1B3C6DU;
  h ^= h >> 12;
  h *= 0x297A2D39U;
  return h ^ (h >> 15);
}

/// Two whole numbers in [-radius, radius].
cv::Point random_step(std::uint32_t hash, int radius) {
  const auto span = static_cast<std::uint32_t>(2 * radius + 1);
  return {static_cast<int>((hash & 0xFFFFU) * span >> 16) - radius,
          static_cast<int>((hash >> 16) * span >> 16) - radius};
}

using Pyramid = std::vector<DescriptorField>;

Pyramid pyramid_of(const cv::Mat1f& grey) {
  Pyramid levels;
  cv::Mat1f level = grey;
  levels.emplace_back(level);
  while (std::min(level.cols, level.rows) >= 2 * kMinSide_px && levels.size() < 5) {
    cv::resize(level, level, {}, 0.5, 0.5, cv::INTER_AREA);
    levels.emplace_back(level);
  }
  return levels;
}

/// Seeds of one picture and their motions at the present level.
class Seeds {
 public:
  Seeds(cv::Size picture, const PatchMatchOptions& options)
      : options_(options),
        cols_((picture.width + options.spacing_px - 1) / options.spacing_px),
        rows_((picture.height + options.spacing_px - 1) / options.spacing_px),
        motion_(static_cast<std::size_t>(cols_) * static_cast<std::size_t>(rows_)),
        cost_(motion_.size()) {}

  int cols() const { return cols_; }
  int rows() const { return rows_; }
  cv::Point at(int col, int row) const { return {col * options_.spacing_px, row * options_.spacing_px}; }
  cv::Point motion(int col, int row) const { return motion_[index(col, row)]; }

  void search(const Pyramid& from, const Pyramid& to, int longest_px) {
    for (int level = static_cast<int>(from.size()) - 1; level >= 0; --level) {
      const bool coarsest = level + 1 == static_cast<int>(from.size());
      const int radius = level > 0 ? std::max(1, longest_px >> level) : kCorrection_px;
      for (std::size_t k = 0; k < motion_.size(); ++k)
        motion_[k] = coarsest ? random_step(hashed(static_cast<std::uint32_t>(k), 0, 99), radius) : 2 * motion_[k];
      search_level(from[static_cast<std::size_t>(level)], to[static_cast<std::size_t>(level)], level, radius);
    }
  }

 private:
  std::size_t index(int col, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(cols_) + static_cast<std::size_t>(col);
  }
  cv::Point at_level(int col, int row, int level, const DescriptorField& field) const {
    return {std::min(at(col, row).x >> level, field.width() - 1),
            std::min(at(col, row).y >> level, field.height() - 1)};
  }

  void search_level(const DescriptorField& from, const DescriptorField& to, int level, int radius) {
    for (int row = 0; row < rows_; ++row)
      for (int col = 0; col < cols_; ++col) {
        const cv::Point here = at_level(col, row, level, from);
        cost_[index(col, row)] = kNone;
        consider(from.at(here.x, here.y), here, to, index(col, row), motion_[index(col, row)]);
      }
    for (int round = 0; round < options_.rounds; ++round) {
      const bool backwards = round % 2 == 1;
      for (int k = 0; k < cols_ * rows_; ++k) {
        const int seed = backwards ? cols_ * rows_ - 1 - k : k;
        improve(from, to, level, radius, round, seed % cols_, seed / cols_, backwards ? 1 : -1);
      }
    }
  }

  /// What the two neighbours visited before have, then random steps around the best, ever shorter.
  void improve(const DescriptorField& from, const DescriptorField& to, int level, int radius, int round, int col,
               int row, int before) {
    const cv::Point here = at_level(col, row, level, from);
    const DescriptorField::Descriptor look = from.at(here.x, here.y);
    const std::size_t k = index(col, row);
    if (col + before >= 0 && col + before < cols_) consider(look, here, to, k, motion_[index(col + before, row)]);
    if (row + before >= 0 && row + before < rows_) consider(look, here, to, k, motion_[index(col, row + before)]);
    std::uint32_t draw = 0;
    for (int reach = radius; reach >= 1; reach /= 2)
      for (int time = 0; time < (reach > kCorrection_px ? kFarDraws : 1); ++time, ++draw) {
        const std::uint32_t hash =
            hashed(static_cast<std::uint32_t>(k), static_cast<std::uint32_t>(level * 64 + round), draw);
        consider(look, here, to, k, motion_[k] + random_step(hash, reach));
      }
  }

  void consider(const DescriptorField::Descriptor& look, cv::Point here, const DescriptorField& to, std::size_t k,
                cv::Point motion) {
    const cv::Point end = here + motion;
    if (end.x < 0 || end.y < 0 || end.x >= to.width() || end.y >= to.height()) return;
    const int cost = to.distance(look, end.x, end.y);
    if (cost >= cost_[k]) return;
    cost_[k] = cost;
    motion_[k] = motion;
  }

  static constexpr int kNone = 1 << 30;
  PatchMatchOptions options_;
  int cols_, rows_;
  std::vector<cv::Point> motion_;
  std::vector<int> cost_;
};

/// Matches whose end's seed leads back.
std::vector<SparseMatch> consistent(const Seeds& there, const Seeds& back, const PatchMatchOptions& options) {
  std::vector<SparseMatch> matches;
  for (int row = 0; row < there.rows(); ++row)
    for (int col = 0; col < there.cols(); ++col) {
      const cv::Point at = there.at(col, row), motion = there.motion(col, row), end = at + motion;
      if (end.x < 0 || end.y < 0) continue;
      const int back_col = (end.x + options.spacing_px / 2) / options.spacing_px,
                back_row = (end.y + options.spacing_px / 2) / options.spacing_px;
      if (back_col >= back.cols() || back_row >= back.rows()) continue;
      const cv::Point loop = motion + back.motion(back_col, back_row);
      if (std::hypot(loop.x, loop.y) <= options.consistent_px) matches.push_back({at, motion});
    }
  return matches;
}

}  // namespace

SparseMatches patch_matches(const cv::Mat1f& a, const cv::Mat1f& b, const PatchMatchOptions& options) {
  const Pyramid levels_a = pyramid_of(a), levels_b = pyramid_of(b);
  const int longest_px = cvRound(options.max_motion_share * std::max({a.cols, a.rows, b.cols, b.rows}));
  Seeds there(a.size(), options), back(b.size(), options);
  there.search(levels_a, levels_b, longest_px);
  back.search(levels_b, levels_a, longest_px);
  return {consistent(there, back, options), consistent(back, there, options)};
}

}  // namespace vantage
