#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace vantage {

/// XXH3-128 of a file's bytes, 32 hex digits: what manifests hold. Throws Error(Transient) when unreadable.
std::string hash_file(const std::filesystem::path& path);
/// XXH3-128 of bytes in memory, 32 hex digits.
std::string hash_bytes(std::string_view bytes);
/// SHA-256 of bytes in memory, 64 hex digits.
std::string sha256_hex(std::string_view text);
/// First 32 hex digits of SHA-256: job keys, where a collision would serve a wrong result.
std::string sha256_key(std::string_view text);
/// HMAC-SHA256 cut to 16 bytes, as raw bytes.
std::string hmac_sha256_128(std::string_view key, std::string_view message);
/// num_bytes from the system's secure generator.
std::string random_bytes(std::size_t num_bytes);
/// Lower-case hex digits.
std::string to_hex(std::string_view bytes);

}  // namespace vantage
