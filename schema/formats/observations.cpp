#include "schema/formats/observations.h"

#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <sstream>

#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr const char* kHeader = "# POINT3D_ID CAMERA FRAME X Y; FRAME -: at all times; px of the footage\n";

/// False when the text is neither - nor a frame number.
bool parse_frame(const std::string& text, std::optional<int>& out) {
  int frame = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), frame);
  if (failure == std::errc() && end == text.data() + text.size() && frame >= 0) out = frame;
  return out || text == "-";
}

std::optional<PointObservation> parse(const std::string& line) {
  std::istringstream words(line);
  PointObservation out;
  std::string frame, rest;
  if (!(words >> out.point >> out.camera >> frame >> out.px.x() >> out.px.y()) || words >> rest) return std::nullopt;
  if (!parse_frame(frame, out.frame) || out.point < 1) return std::nullopt;
  --out.point;
  return out;
}

}  // namespace

void write_observations(const fs::path& file, const std::vector<PointObservation>& observations) {
  std::string text = kHeader;
  for (const auto& o : observations)
    text += fmt::format("{} {} {} {:.9g} {:.9g}\n", o.point + 1, o.camera, o.frame ? std::to_string(*o.frame) : "-",
                        o.px.x(), o.px.y());
  write_file_atomically(file, text);
}

std::vector<PointObservation> read_observations(const fs::path& file) {
  std::ifstream in(file);
  if (!in) throw Error(ErrorKind::BadInput, fmt::format("{}: not found or unreadable", file.string()));
  std::vector<PointObservation> out;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (line.empty() || line[0] == '#') continue;
    const auto observation = parse(line);
    if (!observation)
      throw Error(ErrorKind::BadInput,
                  fmt::format("{}:{}: found '{}', expected POINT3D_ID CAMERA FRAME X Y", file.string(), number, line));
    out.push_back(*observation);
  }
  return out;
}

}  // namespace vantage
