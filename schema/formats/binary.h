#pragma once
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>

#include "schema/base/error.h"

namespace vantage {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

/// Appends numbers to a file's bytes, little-endian.
class BinaryWriter {
 public:
  template <class T>
  void put(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  void put_size(std::size_t n) { put(static_cast<std::uint32_t>(n)); }
  void put_bytes(const void* data, std::size_t n) { bytes_.append(static_cast<const char*>(data), n); }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

/// Takes numbers from a file's bytes, little-endian. Throws Error(BadInput), which names the file, where they end
/// early.
class BinaryReader {
 public:
  BinaryReader(std::string bytes, std::string where) : bytes_(std::move(bytes)), where_(std::move(where)) {}
  template <class T>
  T get() {
    T value;
    get_bytes(&value, sizeof(T));
    return value;
  }
  /// A count of things of at least item_bytes each: refused when the file cannot hold them.
  std::size_t get_size(std::size_t item_bytes) {
    const std::size_t n = get<std::uint32_t>();
    if (n > (bytes_.size() - at_) / item_bytes) fail("is truncated");
    return n;
  }
  void get_bytes(void* data, std::size_t n) {
    if (n > bytes_.size() - at_) fail("is truncated");
    std::memcpy(data, bytes_.data() + at_, n);
    at_ += n;
  }
  bool at_end() const { return at_ == bytes_.size(); }
  [[noreturn]] void fail(const std::string& what) const { throw Error(ErrorKind::BadInput, where_ + ": " + what); }

 private:
  std::string bytes_, where_;
  std::size_t at_ = 0;
};

}  // namespace vantage
