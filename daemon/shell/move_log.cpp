#include "daemon/shell/move_log.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace bushd::daemon {
namespace {

bool is_null_device(const struct stat& status) {
  constexpr dev_t kMemoryDevices = 1;  // of Linux; 3 is /dev/null
  return S_ISCHR(status.st_mode) && major(status.st_rdev) == kMemoryDevices &&
         minor(status.st_rdev) == 3;
}

}  // namespace

Result<MoveLog> MoveLog::open(const std::string& path, std::uint64_t max_bytes) {
  // A FIFO that nobody reads would not even be opened without O_NONBLOCK.
  const int fd =
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, 0644);
  const int error = errno;
  struct stat status{};
  const bool is_there = fd >= 0 ? ::fstat(fd, &status) == 0 : ::stat(path.c_str(), &status) == 0;
  if (is_there && !S_ISREG(status.st_mode) && !is_null_device(status)) {
    if (fd >= 0) ::close(fd);
    return fail(Error{.message = "the log of moves must be a regular file, and this is none",
                      .file = path});
  }
  if (fd < 0) {
    return fail(
        Error{.message = std::string("the log of moves cannot be opened: ") + std::strerror(error),
              .file = path});
  }
  return MoveLog(fd, path, max_bytes);
}

MoveLog::~MoveLog() {
  if (fd_ < 0) return;
  ::fsync(fd_);
  ::close(fd_);
}

bool MoveLog::is_at_its_path() const {
  struct stat open{};
  struct stat there{};
  return ::fstat(fd_, &open) == 0 && ::stat(path_.c_str(), &there) == 0 &&
         open.st_dev == there.st_dev && open.st_ino == there.st_ino;
}

// What is no regular file never fills.
bool MoveLog::has_room(std::size_t bytes) const {
  struct stat status{};
  if (::fstat(fd_, &status) != 0 || !S_ISREG(status.st_mode) || status.st_size == 0) return true;
  return static_cast<std::uint64_t>(status.st_size) + bytes <= max_bytes_;
}

Result<void> MoveLog::begin_anew() {
  auto anew = open(path_, max_bytes_);
  if (!anew) return fail(anew.error());
  std::swap(fd_, anew->fd_);
  return {};
}

Result<MoveLog::Appended> MoveLog::append(const std::string& line) {
  Appended appended = Appended::kOn;
  const std::string text = line + "\n";
  if (!is_at_its_path()) {
    if (auto begun = begin_anew(); !begun) return fail(begun.error());
    appended = Appended::kAnew;
  }
  if (!has_room(text.size())) {
    if (std::rename(path_.c_str(), full_path().c_str()) != 0) {
      return fail(Error{.message = std::string("a line was lost: the file is full and cannot be "
                                               "renamed: ") +
                                   std::strerror(errno),
                        .file = path_});
    }
    if (auto begun = begin_anew(); !begun) return fail(begun.error());
    appended = Appended::kFull;
  }
  const ssize_t n = ::write(fd_, text.data(), text.size());
  if (n == static_cast<ssize_t>(text.size())) return appended;
  const int error = errno;
  // Half a line would spoil the next one too.
  struct stat status{};
  if (n > 0 && ::fstat(fd_, &status) == 0) {
    static_cast<void>(::ftruncate(fd_, status.st_size - n));
  }
  return fail(Error{
      .message = std::string("a line was lost: ") + (n < 0 ? std::strerror(error) : "disk full"),
      .file = path_});
}

}  // namespace bushd::daemon
