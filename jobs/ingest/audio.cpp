#include "jobs/ingest/audio.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <optional>

#include "schema/base/json.h"
#include "schema/base/program.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr int kSampleRateHz = 16000;
constexpr int kSamplesPerValue = static_cast<int>(kSampleRateHz / kEnvelopeRateHz);

/// When the first sound track starts, on the file's clock; empty when there is none.
std::optional<double> sound_start_s(const fs::path& video, const fs::path& scratch) {
  const fs::path answer = scratch / "stream.json";
  const int status = run_program({"ffprobe", "-v", "quiet", "-select_streams", "a:0", "-show_entries",
                                  "stream=start_time", "-of", "json", fs::absolute(video).string()},
                                 {.stdout_file = answer, .stderr_file = {}});
  if (status != 0) return std::nullopt;
  const Json streams = read_json(answer).value("streams", Json::array());
  if (streams.empty()) return std::nullopt;
  const std::string text = streams[0].value("start_time", "0");
  return text == "N/A" ? 0.0 : std::stod(text);
}

/// Samples come from the file one value's worth at a time, so that hours of sound need no memory.
std::vector<double> rms_of(const fs::path& raw_float_samples, double seconds_after_first_picture) {
  const auto lead = std::lround(seconds_after_first_picture * kSampleRateHz);
  std::vector<double> rms(static_cast<std::size_t>(std::max(0L, lead / kSamplesPerValue)), 0.0);
  std::ifstream in(raw_float_samples, std::ios::binary);
  if (lead < 0) in.seekg(-lead * static_cast<std::streamoff>(sizeof(float)));
  std::array<float, kSamplesPerValue> block{};
  while (in.read(reinterpret_cast<char*>(block.data()), sizeof(block))) {
    double sum = 0;
    for (const float v : block) sum += static_cast<double>(v) * v;
    rms.push_back(std::sqrt(sum / kSamplesPerValue));
  }
  return rms;
}

}  // namespace

std::vector<double> audio_envelope(const fs::path& video, double first_picture_s, const fs::path& scratch) {
  const auto sound_s = sound_start_s(video, scratch);
  if (!sound_s) return {};
  const fs::path samples = scratch / "sound.f32";
  // A track that breaks off still leaves what could be read, so the exit status does not matter.
  run_program({"ffmpeg", "-v", "error", "-nostdin", "-y", "-i", fs::absolute(video).string(), "-map", "0:a:0", "-ac",
               "1", "-ar", std::to_string(kSampleRateHz), "-f", "f32le", samples.string()},
              {});
  auto rms = rms_of(samples, *sound_s - first_picture_s);
  fs::remove(samples);
  return rms;
}

}  // namespace vantage
