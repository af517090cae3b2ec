#include "worker/child_link.h"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <vector>

#include "schema/base/clock.h"

namespace vantage {
namespace {

constexpr std::size_t kMaxMessageBytes = 300;
constexpr std::size_t kMaxPacketBytes = 128 << 10U;
constexpr std::int64_t kMinProgressPauseMs = 200;

}  // namespace

Json to_json(const AttemptRef& ref) { return Json::array({ref.job_id, ref.number, ref.token}); }
AttemptRef attempt_ref_of(const Json& j) { return {j.at(0), j.at(1), j.at(2)}; }

Json to_json(const ChildRequest& r) {
  return {{"what", "start"},     {"ref", to_json(r.ref)},    {"spec_path", r.spec_path},
          {"hash", r.spec_hash}, {"kind", r.kind},           {"spec", r.spec},
          {"log", r.log_path},   {"scratch", r.scratch_dir}, {"cores", r.cores}};
}

ChildRequest child_request_of(const Json& j) {
  return {.ref = attempt_ref_of(j.at("ref")),
          .spec_path = j.at("spec_path"),
          .spec_hash = j.at("hash"),
          .kind = j.at("kind"),
          .spec = j.at("spec"),
          .log_path = j.at("log"),
          .scratch_dir = j.at("scratch"),
          .cores = j.at("cores")};
}

bool send_packet(int socket, const Json& packet, Send how) {
  const std::vector<std::uint8_t> bytes = Json::to_msgpack(packet);
  const int flags = MSG_NOSIGNAL | (how == Send::DropWhenFull ? MSG_DONTWAIT : 0);
  ssize_t sent = 0;
  do sent = send(socket, bytes.data(), bytes.size(), flags);
  while (sent < 0 && errno == EINTR);
  return sent == static_cast<ssize_t>(bytes.size());
}

Received receive_packet(int socket) {
  static thread_local std::vector<char> buffer(kMaxPacketBytes);
  const ssize_t n = recv(socket, buffer.data(), buffer.size(), MSG_DONTWAIT);
  if (n == 0) return {.packet = {}, .closed = true};
  if (n < 0) return {.packet = {}, .closed = errno != EAGAIN && errno != EINTR};
  return {.packet = Json::from_msgpack(buffer.begin(), buffer.begin() + n), .closed = false};
}

void ChildLink::progress(double fraction, const std::string& phase) {
  const std::int64_t now_ms = system_clock().monotonic_ms();
  if (now_ms < next_progress_ms_) return;
  next_progress_ms_ = now_ms + kMinProgressPauseMs;
  const double known = std::clamp(fraction, 0.0, 1.0);
  send_packet(socket_,
              {{"what", "progress"},
               {"ref", to_json(ref_)},
               {"fraction", known == known ? known : 0},
               {"phase", one_line(phase)}},
              Send::DropWhenFull);
}

void ChildLink::outcome(const DoneAttempt& outcome) {
  send_packet(socket_, {{"what", "outcome"},
                        {"ref", to_json(ref_)},
                        {"done", outcome.outcome == Outcome::Done},
                        {"error_kind", outcome.error_kind},
                        {"message", outcome.message},
                        {"content", outcome.content},
                        {"damaged_job", outcome.damaged_job}});
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
