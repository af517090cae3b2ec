#include "jobs/sync/motion_codes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace vantage::sync {
namespace {

/// Enough extremal points to tell codes apart, few enough that chance does not match them.
constexpr double kKeepShare = 0.2;
constexpr int kMinCodeOverlap = 8;
/// A pair speaks for the shifts at which it matches nearly as well as it ever does.
constexpr double kNearlyBest = 0.95;
constexpr double kMinMatch = 0.6;

double distance_to_chord(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d d = b - a;
  const double length2 = d.squaredNorm();
  const double u = length2 > 0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0;
  return (p - a - u * d).norm();
}

/// Ones within a bit of each place.
std::vector<std::uint8_t> widened(const std::vector<std::uint8_t>& bits) {
  std::vector<std::uint8_t> out(bits);
  for (std::size_t k = 0; k < bits.size(); ++k)
    if (bits[k]) {
      if (k > 0) out[k - 1] = 1;
      if (k + 1 < bits.size()) out[k + 1] = 1;
    }
  return out;
}

}  // namespace

std::vector<bool> douglas_peucker(std::span<const Eigen::Vector2d> path, double epsilon_px) {
  std::vector<bool> kept(path.size(), false);
  if (path.empty()) return kept;
  kept.front() = kept.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> chords{{0, path.size() - 1}};
  while (!chords.empty()) {
    const auto [first, last] = chords.back();
    chords.pop_back();
    double farthest = epsilon_px;
    std::size_t at = first;
    for (std::size_t k = first + 1; k < last; ++k)
      if (const double d = distance_to_chord(path[k], path[first], path[last]); d > farthest) farthest = d, at = k;
    if (at == first) continue;
    kept[at] = true;
    chords.emplace_back(first, at);
    chords.emplace_back(at, last);
  }
  return kept;
}

std::vector<std::uint8_t> motion_code(std::span<const Eigen::Vector2d> path, double keep_share) {
  double low = 0, high = 1;  // epsilon: low keeps too many, high too few
  for (const auto& p : path) high = std::max(high, (p - path.front()).norm());
  std::vector<bool> kept;
  for (int round = 0; round < 24; ++round) {
    const double middle = 0.5 * (low + high);
    kept = douglas_peucker(path, middle);
    const auto num = static_cast<double>(std::count(kept.begin(), kept.end(), true));
    (num > keep_share * static_cast<double>(path.size()) ? low : high) = middle;
  }
  kept = douglas_peucker(path, high);
  std::vector<std::uint8_t> code(path.size(), 0);
  for (std::size_t k = 1; k + 1 < path.size(); ++k) code[k] = kept[k] ? 1 : 0;
  return code;
}

PlacedCode code_of(const TimedTrack& track, double step_s, double keep_share) {
  const int first = static_cast<int>(std::ceil(track.begin_s() / step_s - 1e-6));
  const int last = static_cast<int>(std::floor(track.end_s() / step_s + 1e-6));
  std::vector<Eigen::Vector2d> path;
  for (int k = first; k <= last; ++k) path.push_back(*track.at(std::clamp(k * step_s, track.begin_s(), track.end_s())));
  return {first, motion_code(path, keep_share)};
}

double match_codes(const PlacedCode& a, const PlacedCode& b, int shift, int min_overlap) {
  const int b_first = b.first + shift;
  const int first = std::max(a.first, b_first);
  const int last = std::min(a.first + static_cast<int>(a.bits.size()), b_first + static_cast<int>(b.bits.size()));
  if (last - first < min_overlap) return 0;
  const std::vector<std::uint8_t> wide_a = widened(a.bits), wide_b = widened(b.bits);
  double num_a = 0, num_b = 0, meet_a = 0, meet_b = 0;
  for (int k = first; k < last; ++k) {
    const auto i = static_cast<std::size_t>(k - a.first), j = static_cast<std::size_t>(k - b_first);
    num_a += a.bits[i];
    num_b += b.bits[j];
    meet_a += a.bits[i] & wide_b[j];
    meet_b += b.bits[j] & wide_a[i];
  }
  return num_a > 0 && num_b > 0 ? 0.5 * (meet_a + meet_b) / std::sqrt(num_a * num_b) : 0;
}

CodeVote vote_by_codes(const std::vector<TimedTrack>& a, const std::vector<TimedTrack>& b,
                       const std::vector<TrackMatch>& matches, const OffsetRange& range) {
  CodeVote vote;
  const double step_s = 2 * range.step_s;
  if (range.num() == 0) return vote;
  const int first = static_cast<int>(std::ceil(range.min_s / step_s)),
            last = static_cast<int>(std::floor(range.max_s / step_s));
  std::map<std::size_t, PlacedCode> codes_a, codes_b;
  std::map<int, double> votes;
  std::vector<std::vector<int>> spoken;  // by match: shifts it speaks for
  for (const TrackMatch& match : matches) {
    const PlacedCode& code_a = codes_a.try_emplace(match.a, code_of(a[match.a], step_s, kKeepShare)).first->second;
    const PlacedCode& code_b = codes_b.try_emplace(match.b, code_of(b[match.b], step_s, kKeepShare)).first->second;
    const auto shorter = static_cast<int>(std::min(code_a.bits.size(), code_b.bits.size()));
    std::map<int, double> scores;
    double best = kMinMatch;
    for (int shift = first; shift <= last; ++shift) {
      scores[shift] = match_codes(code_a, code_b, shift, std::max(kMinCodeOverlap, shorter / 2));
      best = std::max(best, scores[shift]);
    }
    spoken.emplace_back();
    for (const auto& [shift, score] : scores)
      if (score >= kNearlyBest * best) spoken.back().push_back(shift);
    // A pair that fits many shifts says little about each.
    for (const int shift : spoken.back()) votes[shift] += scores[shift] / static_cast<double>(spoken.back().size());
  }
  const auto smooth = [&](int shift) {
    const auto at = [&](int s) {
      const auto found = votes.find(s);
      return found == votes.end() ? 0.0 : found->second;
    };
    return at(shift) + 0.5 * (at(shift - 1) + at(shift + 1));
  };
  int winner = first;
  for (int shift = first; shift <= last; ++shift)
    if (smooth(shift) > smooth(winner)) winner = shift;
  double second = 0;
  for (int shift = first; shift <= last; ++shift)
    if (std::abs(shift - winner) > 2) second = std::max(second, smooth(shift));
  for (const auto& shifts : spoken)
    vote.num_inliers +=
        std::any_of(shifts.begin(), shifts.end(), [&](int s) { return std::abs(s - winner) <= 1; }) ? 1 : 0;
  vote.offset_s = winner * step_s;
  vote.score = smooth(winner);
  vote.contrast = second > 0 ? vote.score / second : std::numeric_limits<double>::infinity();
  return vote;
}

}  // namespace vantage::sync
