#include "schema/base/log_file.h"

#include <fmt/format.h>
#include <spdlog/sinks/rotating_file_sink.h>
#include <spdlog/spdlog.h>

#include "schema/base/error.h"

namespace vantage {

void also_log_to(const std::filesystem::path& file, int max_mb, int num_files) {
  try {
    spdlog::default_logger()->sinks().push_back(std::make_shared<spdlog::sinks::rotating_file_sink_mt>(
        file.string(), static_cast<std::size_t>(max_mb) * 1'000'000, static_cast<std::size_t>(num_files)));
    spdlog::default_logger()->flush_on(spdlog::level::info);
  } catch (const spdlog::spdlog_ex& e) {
    throw Error(ErrorKind::Resource, fmt::format("{}: cannot be logged to: {}", file.string(), e.what()));
  }
}

}  // namespace vantage
