#include "daemon/move_log.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace bushd::daemon {

Result<MoveLog> MoveLog::open(const std::string& path) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (fd < 0) {
    return fail(
        Error{.message = std::string("the log of moves cannot be opened: ") + std::strerror(errno),
              .file = path});
  }
  return MoveLog(fd, path);
}

MoveLog::~MoveLog() {
  if (fd_ < 0) return;
  ::fsync(fd_);
  ::close(fd_);
}

Result<void> MoveLog::append(const std::string& line) {
  const std::string text = line + "\n";
  const ssize_t n = ::write(fd_, text.data(), text.size());
  if (n == static_cast<ssize_t>(text.size())) return {};
  // Half a line would spoil the next one too.
  struct stat status {};
  if (n > 0 && ::fstat(fd_, &status) == 0) {
    static_cast<void>(::ftruncate(fd_, status.st_size - n));
  }
  return fail(Error{
      .message = std::string("a line was lost: ") + (n < 0 ? std::strerror(errno) : "disk full"),
      .file = path_});
}

}  // namespace bushd::daemon
