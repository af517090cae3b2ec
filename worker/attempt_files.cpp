#include "worker/attempt_files.h"

#include <algorithm>
#include <fstream>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/json.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {
constexpr std::size_t kMaxMessageBytes = 300;
constexpr auto kMinProgressPause = std::chrono::milliseconds(200);
}  // namespace

void ProgressWriter::write(double fraction, const std::string& phase) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) return;
  next_ = now + kMinProgressPause;
  // Renamed, so that the reader sees it whole; not fsynced, since it may be lost.
  const fs::path temporary = file_.string() + ".tmp";
  std::ofstream(temporary) << Json{{"fraction", fraction}, {"phase", phase}}.dump(-1, ' ', false,
                                                                                  Json::error_handler_t::replace);
  std::error_code ignored;  // progress is for people: trouble with it must not stop the job
  fs::rename(temporary, file_, ignored);
}

std::optional<Progress> read_progress(const fs::path& file) {
  std::ifstream in(file);
  if (!in) return std::nullopt;
  const Json j = Json::parse(in, nullptr, false);
  if (!j.is_object() || !j.contains("fraction") || !j["fraction"].is_number() || !j.contains("phase") ||
      !j["phase"].is_string())
    return std::nullopt;
  return Progress{std::clamp(j["fraction"].get<double>(), 0.0, 1.0), j["phase"]};
}

void write_outcome(const fs::path& file, const DoneAttempt& outcome) {
  const Json j = {{"done", outcome.outcome == Outcome::Done},
                  {"error_kind", outcome.error_kind},
                  {"message", outcome.message},
                  {"content", outcome.content}};
  write_file_atomically(file, j.dump(-1, ' ', false, Json::error_handler_t::replace));
}

std::optional<DoneAttempt> read_outcome(const fs::path& file) {
  std::ifstream in(file);
  if (!in) return std::nullopt;
  try {
    const Json j = Json::parse(in);
    DoneAttempt outcome;
    outcome.outcome = j.at("done").get<bool>() ? Outcome::Done : Outcome::Failed;
    outcome.error_kind = j.at("error_kind");
    outcome.message = j.at("message");
    outcome.content = j.at("content");
    return outcome;
  } catch (const Json::exception&) {
    return std::nullopt;  // half written by a child that was killed: the same as none
  }
}

std::string one_line(const std::string& text) {
  std::string line = text;
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c == '\n' || c == '\r' || c == '\0'; }, ' ');
  while (!line.empty() && line.back() == ' ') line.pop_back();
  if (line.size() <= kMaxMessageBytes) return line;
  std::size_t end = kMaxMessageBytes;
  while (end > 0 && (static_cast<unsigned char>(line[end]) & 0xC0U) == 0x80U) --end;
  return line.substr(0, end);
}

}  // namespace vantage
