#include "control/pid_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>

namespace bushd::control {
namespace {

// A holder that has not written its number yet, or a file of somebody else.
std::string holder_in(int fd) {
  std::array<char, 16> text{};
  const ssize_t n = ::pread(fd, text.data(), text.size(), 0);
  const auto end = std::find_if_not(text.begin(), text.begin() + std::max<ssize_t>(n, 0),
                                    [](unsigned char c) { return std::isdigit(c) != 0; });
  return end == text.begin() ? "pid unknown" : "pid " + std::string(text.begin(), end);
}

}  // namespace

PidLock::Attempt PidLock::take(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (fd < 0) return {.error = std::strerror(errno)};
  PidLock lock(fd);
  if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) return {.holder = holder_in(fd)};
    return {.error = std::strerror(errno)};
  }
  const std::string pid = std::to_string(::getpid()) + "\n";
  // For people only: without the number the lock holds as well.
  static_cast<void>(::ftruncate(fd, 0) == 0 && ::pwrite(fd, pid.data(), pid.size(), 0) > 0);
  return {.lock = std::move(lock)};
}

bool PidLock::is_at(const std::string& path) const {
  struct stat locked{};
  struct stat named{};
  return ::fstat(fd_, &locked) == 0 && ::stat(path.c_str(), &named) == 0 &&
         locked.st_dev == named.st_dev && locked.st_ino == named.st_ino;
}

PidLock::~PidLock() {
  if (fd_ >= 0) ::close(fd_);
}

}  // namespace bushd::control
