#include "schema/messages/farm.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMinKeyChars = 16;

/// Writes a file that only its owner can read, then gives it its name unless another process was first.
void create_key_file(const fs::path& path) {
  const fs::path temporary = path.string() + "." + to_hex(random_bytes(6));
  const int fd = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  const std::string text = to_hex(random_bytes(32)) + "\n";
  const bool written =
      fd >= 0 && write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && fsync(fd) == 0;
  const int saved = errno;
  if (fd >= 0) close(fd);
  if (written) link(temporary.c_str(), path.c_str());
  unlink(temporary.c_str());
  if (!written)
    throw Error(ErrorKind::Resource,
                fmt::format("{}: cannot write the farm's key: {}", path.string(), std::strerror(saved)));
}

/// Whoever reads the key can give orders to the farm.
void refuse_public_key_file(const fs::path& path) {
  constexpr fs::perms kOthers = fs::perms::group_all | fs::perms::others_all;
  const fs::perms mode = fs::status(path).permissions();
  if ((mode & kOthers) != fs::perms::none)
    throw Error(
        ErrorKind::BadInput,
        fmt::format("{0}: others can use the farm's key: its mode is {1:04o}, expected 0600; run 'chmod 600 {0}'",
                    path.string(), static_cast<unsigned>(mode)));
}

}  // namespace

Farm farm_of_key(const std::string& key) {
  if (key.size() < kMinKeyChars)
    throw Error(ErrorKind::BadInput,
                fmt::format("farm key has {} characters, expected at least {}", key.size(), kMinKeyChars));
  return {.id = sha256_key("vantage farm id of " + key).substr(0, 16), .key = key};
}

Farm read_farm_key(const fs::path& path) {
  if (!fs::is_regular_file(path))
    throw Error(ErrorKind::BadInput, fmt::format("{}: no such farm key file", path.string()));
  refuse_public_key_file(path);
  std::string line = read_file(path);
  line.resize(std::min(line.size(), line.find_first_of("\r\n")));
  try {
    return farm_of_key(line);
  } catch (const Error& e) {
    throw Error(e.kind(), fmt::format("{}: {}", path.string(), e.what()));
  }
}

Farm read_or_create_farm_key(const fs::path& path) {
  if (!fs::exists(path)) {
    if (path.has_parent_path()) fs::create_directories(path.parent_path());
    create_key_file(path);
  }
  return read_farm_key(path);
}

}  // namespace vantage
