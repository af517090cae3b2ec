#include "scheduler/farm/turn_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "schema/base/error.h"

namespace vantage {
namespace {

/// flock() on a file of one's own fails only when a signal comes in between.
void lock(int fd, int how) {
  while (flock(fd, how) != 0) check(errno == EINTR, "an open file can be locked");
}

}  // namespace

TurnLock::TurnLock(const std::filesystem::path& state_dir)
    : fd_(open((state_dir / "turn.lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
  if (fd_ < 0)
    throw Error(ErrorKind::Resource,
                fmt::format("{}: cannot be opened: {}", (state_dir / "turn.lock").string(), std::strerror(errno)));
}
TurnLock::~TurnLock() { close(fd_); }

TurnLock::Turn::Turn(const TurnLock& turns) : fd_(turns.fd_) { lock(fd_, LOCK_SH); }
TurnLock::Turn::~Turn() { flock(fd_, LOCK_UN); }

void TurnLock::wait_for_turns_to_end() const {
  lock(fd_, LOCK_EX);
  lock(fd_, LOCK_UN);
}

}  // namespace vantage
