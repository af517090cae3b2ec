// Answers that are files: logs, pictures, films, reports.
#include <algorithm>

#include "scheduler/api/files.h"
#include "scheduler/api/handlers.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr std::uintmax_t kMaxLogBytes = 4'000'000;
constexpr std::size_t kPartBytes = 256 * 1024;
constexpr std::size_t kMaxRanges = 4;

void serve_file(const httplib::Request& request, httplib::Response& res, const fs::path& file) {
  if (request.ranges.size() > kMaxRanges) return answer_json(res, {{"error", "at most 4 ranges in one request"}}, 416);
  res.set_content_provider(fs::file_size(file), content_type(file),
                           [file](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
                             const std::string part = read_part(file, offset, std::min(length, kPartBytes));
                             return !part.empty() && sink.write(part.data(), part.size());
                           });
}

std::uintmax_t not_negative(std::int64_t value) {
  return static_cast<std::uintmax_t>(std::max<std::int64_t>(0, value));
}

}  // namespace

void Handlers::log(const Call& call, httplib::Response& res) {
  FarmQueries queries(context_.state_dir);
  const auto attempt = call.integer("attempt", -1);
  const fs::path log =
      queries.log_path(call.number("job"), attempt < 0 ? std::nullopt : std::optional<int>(static_cast<int>(attempt)));
  std::error_code none;
  const std::uintmax_t size = log.empty() ? 0 : fs::file_size(log, none);
  if (log.empty() || none) throw NotFound("the job has no log yet");
  auto offset = not_negative(call.integer("offset", 0));
  const auto tail = not_negative(call.integer("tail", 0));
  if (tail > 0 && size > tail) offset = std::max(offset, size - tail);
  res.set_header("X-Log-Size", std::to_string(size));
  res.set_content(read_part(log, offset, kMaxLogBytes), "text/plain; charset=utf-8");
}

void Handlers::preview(const Call& call, httplib::Response& res) {
  const fs::path picture = FarmQueries(context_.state_dir).preview_path(call.number("job"));
  if (picture.empty()) throw NotFound("the job has no picture");
  res.set_header("Cache-Control", "max-age=86400");  // the page asks by key, and what a key names never changes
  serve_file(*call.request, res, picture);
}

void Handlers::shot_file(const Call& call, const std::string& folder, httplib::Response& res) const {
  const std::string relative = folder + "/" + call.word("path");
  const fs::path file = servable_file(FarmQueries(context_.state_dir).shot_folder(call.number("shot")), relative);
  if (file.empty()) throw NotFound("the shot has no file " + relative);
  // A report carries its styles inside and is made of escaped text.
  serve_file(*call.request, res, file);
}

void Handlers::out_file(const Call& call, httplib::Response& res) { shot_file(call, "out", res); }
void Handlers::store_file(const Call& call, httplib::Response& res) { shot_file(call, ".vantage/store", res); }

}  // namespace vantage
