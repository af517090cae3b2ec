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

bool has_time_for_each(std::span<const double> packets_s, std::size_t num_frames) {
  if (packets_s.size() != num_frames) return false;
  return std::ranges::adjacent_find(packets_s, [](double a, double b) { return !(b > a + kSameTimeS); }) ==
         packets_s.end();
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

TimeStamps time_stamps(std::span<const double> decoder_s, std::span<const double> packets_s, double nominal_fps) {
  TimeStamps out{.fps = nominal_fps, .pts_s = {}};
  if (has_time_for_each(packets_s, decoder_s.size())) {
    out.pts_s.assign(packets_s.begin(), packets_s.end());
    return out;
  }
  // 0 unless the first frames could not be decoded.
  const double first_s = decoder_s.size() > 1 && decoder_s[0] > 0 && decoder_s[0] < decoder_s[1] ? decoder_s[0] : 0.0;
  for (const double told_s : decoder_s) {
    if (out.pts_s.empty()) {
      out.pts_s.push_back(0);
      continue;
    }
    const double before_s = out.pts_s.back(), time_s = told_s - first_s;
    const auto packet = std::ranges::upper_bound(packets_s, before_s + first_s + 0.25 / nominal_fps);
    const bool is_told = time_s > before_s + kSameTimeS, is_in_packets = packet != packets_s.end();
    out.num_guessed += !is_told && !is_in_packets;
    out.pts_s.push_back(is_told ? time_s : is_in_packets ? *packet - first_s : before_s + 1 / nominal_fps);
  }
  return out;
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
