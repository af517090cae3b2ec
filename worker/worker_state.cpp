#include "worker/worker_state.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "schema/base/clock.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "schema/base/json.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr int kLockPatience_ms = 5000;

std::string new_uuid() {
  const std::string h = to_hex(random_bytes(16));
  return fmt::format("{}-{}-{}-{}-{}", h.substr(0, 8), h.substr(8, 4), h.substr(12, 4), h.substr(16, 4), h.substr(20));
}

Json to_json(const DoneAttempt& d) {
  return {{"job_id", d.ref.job_id},       {"number", d.ref.number},
          {"token", d.ref.token},         {"outcome", static_cast<int>(d.outcome)},
          {"error_kind", d.error_kind},   {"message", d.message},
          {"content", d.content},         {"exit_code", d.exit_code},
          {"signal", d.signal},           {"wall_ms", d.wall_ms},
          {"peak_rss_mb", d.peak_rss_mb}, {"damaged_job", d.damaged_job}};
}

DoneAttempt done_attempt_of(const Json& j) {
  DoneAttempt d;
  d.ref = {j.at("job_id"), j.at("number"), j.at("token")};
  d.outcome = static_cast<Outcome>(std::clamp(j.at("outcome").get<int>(), 0, static_cast<int>(Outcome::Canceled)));
  d.error_kind = j.at("error_kind");
  d.message = j.at("message");
  d.content = j.at("content");
  d.exit_code = j.at("exit_code");
  d.signal = j.at("signal");
  d.wall_ms = j.at("wall_ms");
  d.peak_rss_mb = j.at("peak_rss_mb");
  d.damaged_job = j.value("damaged_job", "");  // files of before have none
  return d;
}

}  // namespace

WorkerState::WorkerState(fs::path folder) : folder_(fs::absolute(std::move(folder))) {
  fs::create_directories(folder_);
  lock();
  load_identity();
  fs::remove_all(folder_ / "attempts");  // their processes died with the worker that started them
}

WorkerState::~WorkerState() { close(lock_fd_); }

void WorkerState::lock() {
  const fs::path path = folder_ / "lock";
  lock_fd_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (lock_fd_ < 0)
    throw Error(ErrorKind::BadInput, fmt::format("{}: cannot open: {}", path.string(), std::strerror(errno)));
  // A worker whose farm was killed needs a moment to notice and end.
  for (int tries = 0; flock(lock_fd_, LOCK_EX | LOCK_NB) != 0; ++tries) {
    if (tries < kLockPatience_ms / 50) {
      usleep(50'000);
      continue;
    }
    close(lock_fd_);
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: another worker uses this folder; give each its own --state", folder_.string()));
  }
}

void WorkerState::load_identity() {
  const fs::path path = folder_ / "worker.json";
  std::int64_t last_incarnation = 0;
  if (fs::exists(path)) {
    try {
      const Json j = read_json(path);
      worker_id_ = j.at("id");
      last_incarnation = j.at("incarnation");
    } catch (const Json::exception& e) {
      throw Error(ErrorKind::BadInput, fmt::format("{}: is no worker's identity: {}", path.string(), e.what()));
    }
  } else {
    worker_id_ = new_uuid();
  }
  // Rises even when the clock was set back, so that messages of an earlier life are known as such.
  constexpr int kRandomBits = 16;
  const std::int64_t now = system_clock().wall_ms() << kRandomBits | static_cast<unsigned char>(random_bytes(1)[0]);
  incarnation_ = std::max(now, last_incarnation + 1);
  write_json(path, {{"id", worker_id_}, {"incarnation", incarnation_}});
}

std::vector<DoneAttempt> WorkerState::read_outbox() const {
  const fs::path path = folder_ / "outbox.json";
  std::vector<DoneAttempt> out;
  if (!fs::exists(path)) return out;
  try {
    for (const Json& j : read_json(path)) out.push_back(done_attempt_of(j));
  } catch (const std::exception& e) {
    // Not worth refusing to start: the scheduler finds what was committed by its key.
    spdlog::warn("{}: unreadable, results that were not reported are left to the scheduler: {}", path.string(),
                 e.what());
    out.clear();
  }
  return out;
}

void WorkerState::write_outbox(const std::vector<DoneAttempt>& done) const {
  Json all = Json::array();
  for (const DoneAttempt& d : done) all.push_back(to_json(d));
  const fs::path temporary = folder_ / "outbox.json.tmp";
  std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
  out << all.dump(-1, ' ', false, Json::error_handler_t::replace);
  out.close();
  if (!out) throw Error(ErrorKind::Resource, fmt::format("{}: cannot be written", temporary.string()));
  fs::rename(temporary, folder_ / "outbox.json");
}

fs::path WorkerState::scratch_of(const AttemptRef& ref) const {
  return folder_ / "attempts" / fmt::format("{}.{}", ref.job_id, ref.number);
}

}  // namespace vantage
