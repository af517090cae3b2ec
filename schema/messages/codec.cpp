#include "schema/messages/codec.h"

#include <algorithm>

#include "schema/base/error.h"
#include "schema/base/hash.h"
#include "schema/messages/body.h"

namespace vantage {
namespace {

constexpr std::uint64_t kMagic = 0x56544731;  // "VTG1"
constexpr std::size_t kFarmIdBytes = 16;
constexpr std::size_t kMacBytes = 16;
constexpr std::size_t kMaxSenderBytes = 64;
constexpr std::size_t kFixedBytes = 4 + 2 + 1 + 1 + 2 + 2 + 8 + 8 + kFarmIdBytes;
constexpr std::size_t kMaxBodyBytes = kMaxDatagramBytes - kFixedBytes - kMaxSenderBytes - kMacBytes;

void put(std::string& out, std::uint64_t value, int num_bytes) {
  for (int shift = 8 * (num_bytes - 1); shift >= 0; shift -= 8) out += static_cast<char>(value >> shift & 0xFFU);
}

/// Reads what put() wrote; the caller has checked that the bytes are there.
std::uint64_t get(std::string_view& in, std::size_t num_bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < num_bytes; ++i) value = value << 8U | static_cast<unsigned char>(in[i]);
  in.remove_prefix(num_bytes);
  return value;
}

/// Time must not tell how many bytes of a guessed signature were right.
bool equal_in_constant_time(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  return difference == 0;
}

std::string page_of(std::string_view body, std::size_t page) {
  return std::string(body.substr(page * kMaxBodyBytes, kMaxBodyBytes));
}

}  // namespace

struct Decoder::Envelope {
  int kind = 0;
  std::size_t page = 0, num_pages = 0;
  Origin origin;
  std::string body;
};

std::vector<std::string> encode(const Message& message, const Origin& origin, const Farm& farm) {
  check(origin.sender.size() <= kMaxSenderBytes, "a sender's name has at most 64 bytes");
  check(farm.id.size() == kFarmIdBytes, "a farm's id has 16 digits");
  const std::string body = encode_body(message);
  const std::size_t num_pages = std::max<std::size_t>(1, (body.size() + kMaxBodyBytes - 1) / kMaxBodyBytes);
  check(num_pages <= kMaxPages, "a state fits into kMaxPages datagrams");
  std::vector<std::string> datagrams;
  for (std::size_t page = 0; page < num_pages; ++page) {
    std::string d;
    put(d, kMagic, 4);
    put(d, static_cast<std::uint64_t>(kProtocolVersion), 2);
    put(d, message.index(), 1);
    put(d, origin.sender.size(), 1);
    put(d, page, 2);
    put(d, num_pages, 2);
    put(d, static_cast<std::uint64_t>(origin.incarnation), 8);
    put(d, static_cast<std::uint64_t>(origin.seq), 8);
    d += farm.id + origin.sender + page_of(body, page);
    datagrams.push_back(d + hmac_sha256_128(farm.key, d));
  }
  return datagrams;
}

Decoder::Decoder(Farm farm) : farm_(std::move(farm)) {}

std::optional<Decoder::Envelope> Decoder::open(std::string_view datagram) {
  const auto drop = [](std::int64_t& counter) {
    ++counter;
    return std::nullopt;
  };
  if (datagram.size() < kFixedBytes + kMacBytes || datagram.size() > kMaxDatagramBytes) return drop(drops_.malformed);
  std::string_view in = datagram.substr(0, datagram.size() - kMacBytes);
  if (get(in, 4) != kMagic) return drop(drops_.malformed);
  if (get(in, 2) != static_cast<std::uint64_t>(kProtocolVersion)) {
    note_other_version(datagram);
    return drop(drops_.version);
  }
  Envelope e;
  e.kind = static_cast<int>(get(in, 1));
  const std::size_t sender_bytes = get(in, 1);
  e.page = get(in, 2);
  e.num_pages = get(in, 2);
  e.origin.incarnation = static_cast<std::int64_t>(get(in, 8));
  e.origin.seq = static_cast<std::int64_t>(get(in, 8));
  if (in.substr(0, kFarmIdBytes) != farm_.id) return drop(drops_.foreign);
  in.remove_prefix(kFarmIdBytes);
  const std::string_view mac = datagram.substr(datagram.size() - kMacBytes);
  if (!equal_in_constant_time(mac, hmac_sha256_128(farm_.key, datagram.substr(0, datagram.size() - kMacBytes))))
    return drop(drops_.bad_mac);
  if (sender_bytes > kMaxSenderBytes || sender_bytes > in.size() || e.num_pages < 1 || e.num_pages > kMaxPages ||
      e.page >= e.num_pages)
    return drop(drops_.malformed);
  e.origin.sender = std::string(in.substr(0, sender_bytes));
  e.body = std::string(in.substr(sender_bytes));
  return e;
}

/// Magic, version and name have had their places since version 1; of another farm's programs we want to know nothing.
void Decoder::note_other_version(std::string_view datagram) {
  std::string_view in = datagram.substr(4);
  const auto version = static_cast<int>(get(in, 2));
  in.remove_prefix(1);
  const std::size_t sender_bytes = get(in, 1);
  in.remove_prefix(2 + 2 + 8 + 8);
  if (in.substr(0, kFarmIdBytes) != farm_.id || sender_bytes > kMaxSenderBytes) return;
  std::string sender(in.substr(kFarmIdBytes, sender_bytes));
  std::replace_if(
      sender.begin(), sender.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  other_version_ = {version, std::move(sender)};
}

std::optional<std::string> Decoder::assemble(const Envelope& e) {
  Stream& s = streams_[{e.origin.sender, e.kind}];
  const auto age = [](std::int64_t incarnation, std::int64_t seq) { return std::pair(incarnation, seq); };
  const auto now = age(e.origin.incarnation, e.origin.seq);
  const auto partial = age(s.partial_incarnation, s.partial_seq);
  if (now <= age(s.incarnation, s.seq) || now < partial) {
    ++drops_.older;
    return std::nullopt;
  }
  if (now > partial || s.pages.size() != e.num_pages) {
    s.partial_incarnation = e.origin.incarnation;
    s.partial_seq = e.origin.seq;
    s.pages.assign(e.num_pages, {});
    s.num_pages_there = 0;
  }
  if (!s.pages[e.page].empty()) {
    ++drops_.older;
    return std::nullopt;
  }
  s.pages[e.page] = e.body;
  if (++s.num_pages_there < e.num_pages) return std::nullopt;
  s.incarnation = e.origin.incarnation;
  s.seq = e.origin.seq;
  std::string body;
  for (const std::string& page : s.pages) body += page;
  s.pages.clear();
  return body;
}

std::optional<Message> Decoder::take(std::string_view datagram) {
  const std::optional<Envelope> envelope = open(datagram);
  if (!envelope) return std::nullopt;
  const std::optional<std::string> body = assemble(*envelope);
  if (!body) return std::nullopt;
  std::optional<Message> message = decode_body(envelope->kind, *body);
  if (!message) ++drops_.malformed;
  return message;
}

}  // namespace vantage
