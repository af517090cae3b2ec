#include "schema/base/hash.h"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <xxhash.h>

#include <array>
#include <fstream>
#include <memory>
#include <vector>

#include "schema/base/error.h"
#include "schema/base/hash_watched.h"

namespace vantage {
namespace {
std::string hex128(XXH128_hash_t h) { return fmt::format("{:016x}{:016x}", h.high64, h.low64); }
}  // namespace

std::string hash_file(const std::filesystem::path& path) {
  return hash_file_watched(path, [](std::uintmax_t) {});
}

std::string hash_file_watched(const std::filesystem::path& path,
                              const std::function<void(std::uintmax_t num_bytes)>& on_read) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw Error(ErrorKind::Transient, fmt::format("{}: cannot read to hash it", path.string()));
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  XXH3_128bits_reset(state.get());
  std::vector<char> buffer(1U << 20U);
  std::uintmax_t num_bytes = 0;
  while (in) {
    in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    XXH3_128bits_update(state.get(), buffer.data(), static_cast<std::size_t>(in.gcount()));
    num_bytes += static_cast<std::uintmax_t>(in.gcount());
    on_read(num_bytes);
  }
  if (in.bad()) throw Error(ErrorKind::Transient, fmt::format("{}: read error while hashing", path.string()));
  return hex128(XXH3_128bits_digest(state.get()));
}

std::string hash_bytes(std::string_view bytes) { return hex128(XXH3_128bits(bytes.data(), bytes.size())); }

std::string sha256_hex(std::string_view text) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  check(EVP_Digest(text.data(), text.size(), digest.data(), &size, EVP_sha256(), nullptr) == 1, "SHA-256 is available");
  return to_hex({reinterpret_cast<const char*>(digest.data()), size});
}

std::string sha256_key(std::string_view text) { return sha256_hex(text).substr(0, 32); }

std::string hmac_sha256_128(std::string_view key, std::string_view message) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> mac{};
  unsigned int size = 0;
  const auto* bytes = reinterpret_cast<const unsigned char*>(message.data());
  check(
      HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()), bytes, message.size(), mac.data(), &size) != nullptr,
      "HMAC-SHA256 is available");
  return {reinterpret_cast<const char*>(mac.data()), 16};
}

std::string random_bytes(std::size_t num_bytes) {
  std::string out(num_bytes, '\0');
  check(RAND_bytes(reinterpret_cast<unsigned char*>(out.data()), static_cast<int>(num_bytes)) == 1,
        "the system's random generator works");
  return out;
}

std::string to_hex(std::string_view bytes) {
  std::string out;
  for (const char c : bytes) out += fmt::format("{:02x}", static_cast<unsigned char>(c));
  return out;
}

}  // namespace vantage
