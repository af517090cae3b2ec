#pragma once
/// Messages as datagrams: an envelope with a signature round an LCM-encoded body. Format: README.md beside this file.
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "schema/messages/farm.h"
#include "schema/messages/protocol.h"

namespace vantage {

using Message = std::variant<WorkerReport, WorkerOrders, SchedulerHello>;

/// Never let LCM split a message: 1.3.1 can put fragments together wrongly.
constexpr std::size_t kMaxDatagramBytes = 60'000;
/// A state larger than this many datagrams is refused.
constexpr int kMaxPages = 64;

/// Who says it, and in which order. Receivers drop what is not newer than what they have seen.
struct Origin {
  std::string sender;            ///< worker id, or kSchedulerSender; at most 64 bytes
  std::int64_t incarnation = 0;  ///< of the worker, or the scheduler's epoch: rises with every start
  std::int64_t seq = 0;          ///< rises within an incarnation
};
inline constexpr std::string_view kSchedulerSender = "scheduler";

/// Why datagrams were dropped, how often.
struct DropCounts {
  std::int64_t malformed = 0;   ///< no envelope, or a body that does not decode
  std::int64_t version = 0;     ///< another protocol
  std::int64_t foreign = 0;     ///< another farm
  std::int64_t bad_mac = 0;     ///< this farm's id, but not signed with its key
  std::int64_t older = 0;       ///< repeated, overtaken, or of an earlier incarnation
  std::int64_t queue_full = 0;  ///< nobody took them in time
  std::int64_t total() const { return malformed + version + foreign + bad_mac + older + queue_full; }
};

/// A program of another version that talks on this farm's bus, as its unsigned envelope says.
struct OtherVersion {
  int version = 0;
  std::string sender;  ///< printable
};

/// One datagram, or several pages of one state. Throws Error(Bug) when it would take more than kMaxPages.
std::vector<std::string> encode(const Message& message, const Origin& origin, const Farm& farm);

/// Datagrams back into messages. Bytes are not trusted: nothing is decoded before its signature was checked, and
/// nothing makes it throw. One thread.
class Decoder {
 public:
  explicit Decoder(Farm farm);
  /// The message that this datagram completes; empty while pages are missing, or when it was dropped (see drops()).
  std::optional<Message> take(std::string_view datagram);
  const DropCounts& drops() const { return drops_; }
  /// The last one that was dropped for its version.
  const std::optional<OtherVersion>& other_version() const { return other_version_; }

 private:
  struct Envelope;
  struct Stream {
    std::int64_t incarnation = 0, seq = 0;  ///< newest complete state
    std::int64_t partial_incarnation = 0, partial_seq = 0;
    std::vector<std::string> pages;  ///< of the partial state
    std::size_t num_pages_there = 0;
  };
  std::optional<Envelope> open(std::string_view datagram);
  void note_other_version(std::string_view datagram);
  std::optional<std::string> assemble(const Envelope& envelope);

  Farm farm_;
  std::map<std::pair<std::string, int>, Stream> streams_;  ///< by sender and kind of message
  DropCounts drops_;
  std::optional<OtherVersion> other_version_;
};

}  // namespace vantage
