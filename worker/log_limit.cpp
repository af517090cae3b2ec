#include "worker/log_limit.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>

namespace vantage {
namespace {

class File {
 public:
  explicit File(const std::filesystem::path& path) : fd_(open(path.c_str(), O_RDWR | O_APPEND | O_CLOEXEC)) {}
  ~File() {
    if (fd_ >= 0) close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  int fd() const { return fd_; }
  std::int64_t size() const {
    struct stat status {};
    return fstat(fd_, &status) == 0 ? status.st_size : 0;
  }

 private:
  int fd_;
};

}  // namespace

void LogLimit::enforce() {
  const std::int64_t kept_bytes = sizes_.head_bytes + sizes_.tail_bytes;
  struct stat status {};
  if (stat(file_.c_str(), &status) != 0 || status.st_size <= 2 * kept_bytes) return;
  const File file(file_);
  if (file.fd() < 0) return;
  const std::int64_t size = file.size();
  std::string tail(static_cast<std::size_t>(sizes_.tail_bytes), '\0');
  const ssize_t n = pread(file.fd(), tail.data(), tail.size(), size - sizes_.tail_bytes);
  if (n <= 0) return;
  tail.resize(static_cast<std::size_t>(n));
  tail.erase(0, tail.find('\n') + 1);  // whole lines; npos + 1 is 0
  const auto tail_bytes = static_cast<std::int64_t>(tail.size());
  num_cut_bytes_ += size - sizes_.head_bytes - tail_bytes - marker_bytes_;
  const std::string marker = fmt::format("\n[… {} bytes of log were cut out here …]\n", num_cut_bytes_);
  marker_bytes_ = static_cast<std::int64_t>(marker.size());
  // The child appends, so its next line goes behind ours wherever the end is then.
  if (ftruncate(file.fd(), sizes_.head_bytes) != 0) return;
  tail.insert(0, marker);
  [[maybe_unused]] const ssize_t written =
      write(file.fd(), tail.data(), tail.size());  // on a full disk the tail is lost
}

}  // namespace vantage
