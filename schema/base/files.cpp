#include "schema/base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "schema/base/error.h"
#include "schema/base/json.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(const fs::path& path, const char* what) {
  const bool full = errno == ENOSPC || errno == EDQUOT;
  throw Error(full ? ErrorKind::Resource : ErrorKind::Transient,
              fmt::format("{}: cannot {}: {}", path.string(), what, std::strerror(errno)));
}

fs::path temporary_beside(const fs::path& path) {
  static std::atomic<int> counter{0};
  return path.string() + fmt::format(".tmp.{}.{}", getpid(), counter++);
}

void write_and_sync(const fs::path& path, std::string_view bytes, unsigned mode) {
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, mode);
  if (fd < 0) fail(path, "create");
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = write(fd, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) {
      const int saved = errno;
      close(fd);
      unlink(path.c_str());
      errno = saved;
      fail(path, "write");
    }
    done += static_cast<std::size_t>(n);
  }
  if (fsync(fd) != 0) {
    close(fd);
    fail(path, "fsync");
  }
  if (close(fd) != 0) fail(path, "close");
}

}  // namespace

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) fail(path, "read");
  std::ostringstream text;
  text << in.rdbuf();
  if (in.bad()) fail(path, "read");
  return std::move(text).str();
}

void write_file_atomically(const fs::path& path, std::string_view bytes, unsigned mode) {
  const fs::path temporary = temporary_beside(path);
  write_and_sync(temporary, bytes, mode);
  if (rename(temporary.c_str(), path.c_str()) != 0) {
    const int saved = errno;
    unlink(temporary.c_str());
    errno = saved;
    fail(path, "replace");
  }
  fsync_path(path.has_parent_path() ? path.parent_path() : fs::path("."));
}

void fsync_path(const fs::path& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) fail(path, "open");
  const int rc = fsync(fd);
  close(fd);
  if (rc != 0) fail(path, "fsync");
}

void replace_symlink(const fs::path& target, const fs::path& link) {
  std::error_code ignored;
  if (fs::is_symlink(link, ignored) && fs::read_symlink(link, ignored) == target) return;
  const fs::path temporary = temporary_beside(link);
  fs::create_symlink(target, temporary);
  fs::rename(temporary, link);
}

std::uintmax_t free_disk_mb(const fs::path& path) { return fs::space(path).available >> 20U; }

Json read_json(const fs::path& path) {
  try {
    return Json::parse(read_file(path));
  } catch (const Json::exception& e) {  // also a number that is too large
    throw Error(ErrorKind::BadInput, fmt::format("{}: not valid JSON: {}", path.string(), e.what()));
  }
}

void write_json(const fs::path& path, const Json& value) { write_file_atomically(path, value.dump(1) + "\n"); }

}  // namespace vantage
