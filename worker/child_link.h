#pragma once
/// Packets between a worker, its fork server and the children: JSON (MessagePack) over one sequenced-packet socket, so
/// each arrives whole and nobody needs a file.
#include <cstddef>
#include <optional>
#include <string>

#include "schema/base/json.h"
#include "schema/messages/protocol.h"

namespace vantage {

/// What a child is to do.
struct ChildRequest {
  AttemptRef ref;
  std::string spec_path = {}, spec_hash = {};
  std::string kind = {}, spec = {};  ///< with an empty spec_path: as in Assignment
  std::string log_path = {};         ///< stdout and stderr, appended; empty: the worker's own
  std::string scratch_dir = {};      ///< may be made; the worker removes it
  int cores = 1;
};
Json to_json(const ChildRequest& request);
ChildRequest child_request_of(const Json& json);

Json to_json(const AttemptRef& ref);
AttemptRef attempt_ref_of(const Json& json);

enum class Send { Wait, DropWhenFull };
/// False when it could not be sent.
bool send_packet(int socket, const Json& packet, Send how = Send::Wait);
/// closed: the other side has gone. Empty when nothing waits.
struct Received {
  std::optional<Json> packet;
  bool closed = false;
};
Received receive_packet(int socket);

/// A child's way to tell its worker how it goes. The worker hears of the end by itself.
class ChildLink {
 public:
  ChildLink(int socket, AttemptRef ref) : socket_(socket), ref_(ref) {}
  /// At most five times a second, whatever the job does.
  void progress(double fraction, const std::string& phase);
  /// The child's own view of its end: Done or Failed. A child that tells none crashed.
  void outcome(const DoneAttempt& outcome);

 private:
  int socket_;
  AttemptRef ref_;
  std::int64_t next_progress_ms_ = 0;
};

/// One line of at most 300 bytes, cut between characters of UTF-8.
std::string one_line(const std::string& text);

}  // namespace vantage
