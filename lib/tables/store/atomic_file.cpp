#include "tables/store/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>

namespace bushd::tables::store {
namespace {

constexpr mode_t kNewFileMode = 0644;

tl::unexpected<Error> failed(const std::filesystem::path& path, const char* what) {
  return fail(Error{.message = std::string(what) + ": " + std::strerror(errno) +
                               ". Is the directory there, writable, and the disk not full?",
                    .file = path.string()});
}

bool write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

bool sync_directory(const std::filesystem::path& directory) {
  const int fd = open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool synced = fsync(fd) == 0;
  close(fd);
  return synced;
}

}  // namespace

Result<void> replace_file(const std::filesystem::path& path, std::string_view text) {
  const std::filesystem::path directory = path.has_parent_path() ? path.parent_path() : ".";
  struct stat old {};
  const bool replaces = stat(path.c_str(), &old) == 0;
  // A dot in front: no table's name begins with it, so what a crash leaves behind is never taken
  // for one.
  std::string temporary = (directory / ("." + path.filename().string() + ".XXXXXX")).string();
  const int fd = mkostemp(temporary.data(), O_CLOEXEC);
  if (fd < 0) return failed(path, "cannot be written");
  const mode_t mode = replaces ? old.st_mode & 07777 : kNewFileMode;
  const bool written = fchmod(fd, mode) == 0 && write_all(fd, text) && fsync(fd) == 0;
  const int cause = errno;
  const bool closed = close(fd) == 0;
  if (written && closed && rename(temporary.c_str(), path.c_str()) == 0) {
    if (!sync_directory(directory)) return failed(path, "cannot be synced to the disk");
    return {};
  }
  if (!written) errno = cause;
  const auto error = failed(path, "cannot be written");
  unlink(temporary.c_str());
  return error;
}

Result<FileLock> FileLock::take(const std::filesystem::path& path) {
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kNewFileMode);
  if (fd < 0) return failed(path, "cannot be locked");
  while (flock(fd, LOCK_EX) != 0) {
    if (errno == EINTR) continue;
    const auto error = failed(path, "cannot be locked");
    close(fd);
    return error;
  }
  return FileLock(fd);
}

FileLock::~FileLock() {
  if (fd_ >= 0) close(fd_);
}

}  // namespace bushd::tables::store
