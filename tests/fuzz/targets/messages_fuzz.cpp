// Datagrams of anybody, and datagrams that carry the farm's signature: only those reach the decoder of bodies.
#include "schema/base/hash.h"
#include "schema/messages/codec.h"
#include "tests/fuzz/targets/fuzzing.h"

namespace vantage {
namespace {

const Farm& farm() {
  static const Farm known = farm_of_key("a key of the fuzzer, which is no secret");
  return known;
}

void decode_signed(std::string_view unsigned_datagram) {
  std::string datagram(unsigned_datagram);
  constexpr std::size_t kFarmIdAt = 4 + 2 + 1 + 1 + 2 + 2 + 8 + 8;
  if (datagram.size() >= kFarmIdAt + farm().id.size()) datagram.replace(kFarmIdAt, farm().id.size(), farm().id);
  datagram += hmac_sha256_128(farm().key, datagram);
  Decoder decoder(farm());
  const auto message = decoder.take(datagram);
  if (message) encode(*message, {.sender = "again", .incarnation = 1, .seq = 1}, farm());
}

}  // namespace
}  // namespace vantage

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vantage;
  std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (take_choice(bytes, 2) == 0)
    Decoder(farm()).take(bytes);
  else
    decode_signed(bytes);
  return 0;
}
