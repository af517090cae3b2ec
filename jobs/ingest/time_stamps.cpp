#include "jobs/ingest/time_stamps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <stdexcept>

#include "schema/base/program.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr double kSameTimeS = 1e-6;  // ffprobe prints microseconds

/// "0.033333,K__": pts_time and flags of one packet. Empty for a packet without time or one that is not shown (D).
std::optional<double> packet_time(const std::string& line) {
  const std::size_t comma = line.find(',');
  if (comma == std::string::npos || line.find('D', comma) != std::string::npos) return std::nullopt;
  try {
    return std::stod(line.substr(0, comma));
  } catch (const std::invalid_argument&) {
    return std::nullopt;  // "N/A"
  }
}

double median_interval_s(std::span<const double> pts_s) {
  std::vector<double> intervals;
  for (std::size_t k = 1; k < pts_s.size(); ++k) intervals.push_back(pts_s[k] - pts_s[k - 1]);
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return *middle;
}

/// Frames of a longest sequence of strictly rising stamps (Fredman 1975: patience sorting), rising.
std::vector<std::size_t> longest_rise(std::span<const std::optional<double>> told_s) {
  constexpr auto kNone = static_cast<std::size_t>(-1);
  std::vector<std::size_t> last_of_length, before(told_s.size(), kNone);
  for (std::size_t k = 0; k < told_s.size(); ++k) {
    if (!told_s[k]) continue;
    const auto place = std::ranges::lower_bound(last_of_length, *told_s[k] - kSameTimeS, {},
                                                [&](std::size_t frame) { return *told_s[frame]; });
    if (place != last_of_length.end() && std::abs(*told_s[*place] - *told_s[k]) <= kSameTimeS) continue;
    if (place != last_of_length.begin()) before[k] = *std::prev(place);
    if (place == last_of_length.end())
      last_of_length.push_back(k);
    else
      *place = k;
  }
  std::vector<std::size_t> rise;
  for (std::size_t k = last_of_length.empty() ? kNone : last_of_length.back(); k != kNone; k = before[k])
    rise.push_back(k);
  std::ranges::reverse(rise);
  return rise;
}

}  // namespace

std::vector<double> packet_times_s(const fs::path& video, const fs::path& scratch) {
  const fs::path list = scratch / "packets.csv";
  // The exit status says nothing: a truncated file has packets, too. What is read is checked against the frames.
  run_program({"ffprobe", "-v", "quiet", "-select_streams", "v:0", "-show_entries", "packet=pts_time,flags", "-of",
               "csv=p=0", fs::absolute(video).string()},
              {.stdout_file = list, .stderr_file = {}});
  std::vector<double> times;
  std::ifstream in(list);
  for (std::string line; std::getline(in, line);)
    if (const auto time = packet_time(line)) times.push_back(*time);
  std::sort(times.begin(), times.end());
  if (!times.empty())
    for (const double first = times.front(); double& time : times) time -= first;
  return times;
}

TimeStamps time_stamps(std::span<const std::optional<double>> told_s, double declared_fps) {
  const auto rise = longest_rise(told_s);
  TimeStamps out{.fps = declared_fps, .pts_s = std::vector<double>(told_s.size())};
  out.num_guessed = static_cast<int>(told_s.size() - rise.size());
  for (std::size_t k = 0; k < told_s.size(); ++k) {
    const auto after = std::ranges::lower_bound(rise, k);
    if (rise.empty()) {
      out.pts_s[k] = static_cast<double>(k) / declared_fps;
    } else if (after == rise.begin()) {
      out.pts_s[k] = *told_s[*after] - static_cast<double>(*after - k) / declared_fps;
    } else if (after == rise.end()) {
      out.pts_s[k] = *told_s[rise.back()] + static_cast<double>(k - rise.back()) / declared_fps;
    } else {
      const std::size_t a = *std::prev(after), b = *after;
      out.pts_s[k] = std::lerp(*told_s[a], *told_s[b], static_cast<double>(k - a) / static_cast<double>(b - a));
    }
  }
  for (const double first = out.pts_s.empty() ? 0 : out.pts_s.front(); double& time : out.pts_s) time -= first;
  if (out.pts_s.size() > 2)
    if (const double usual = 1 / median_interval_s(out.pts_s); std::abs(usual / declared_fps - 1) > 0.05)
      out.fps = usual;
  return out;
}

std::vector<std::string> gaps_in(std::span<const double> pts_s) {
  std::vector<std::string> gaps;
  if (pts_s.size() < 3) return gaps;
  const double longest_s = std::max(0.2, 4 * median_interval_s(pts_s));
  for (std::size_t k = 1; k < pts_s.size(); ++k)
    if (pts_s[k] - pts_s[k - 1] > longest_s)
      gaps.push_back(
          fmt::format("no picture from {:.3f} s to {:.3f} s (after frame {})", pts_s[k - 1], pts_s[k], k - 1));
  return gaps;
}

bool has_constant_rate(std::span<const double> pts_s) {
  if (pts_s.size() < 2) return true;
  const double interval_s = (pts_s.back() - pts_s.front()) / static_cast<double>(pts_s.size() - 1);
  for (std::size_t k = 0; k < pts_s.size(); ++k)
    if (std::abs(pts_s[k] - pts_s[0] - static_cast<double>(k) * interval_s) > 0.002) return false;
  return true;
}

std::string declare_fps(TimeStamps& times, double declared_fps) {
  const bool agrees = std::abs(times.fps / declared_fps - 1) < 0.001;
  if (!has_constant_rate(times.pts_s))
    return agrees ? ""
                  : fmt::format("shot.toml says {:g} fps, but the footage's rate varies: its time stamps are used",
                                declared_fps);
  const std::string sentence = agrees ? ""
                                      : fmt::format("shot.toml says {:g} fps, the footage {:g}: {:g} is used",
                                                    declared_fps, times.fps, declared_fps);
  times.fps = declared_fps;
  for (std::size_t k = 0; k < times.pts_s.size(); ++k) times.pts_s[k] = static_cast<double>(k) / declared_fps;
  return sentence;
}

}  // namespace vantage
