#include "tables/store/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

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

constexpr int kMaxKept = 1000;

std::filesystem::path aside_path(const std::filesystem::path& directory, const std::string& name,
                                 int number) {
  const std::string count = number == 1 ? "" : "-" + std::to_string(number);
  return directory / ("." + name + ".edited" + count + ".toml");
}

Result<std::filesystem::path> keep_in(const std::filesystem::path& directory,
                                      const std::string& name, std::string_view text) {
  for (int number = 1; number <= kMaxKept; ++number) {
    std::filesystem::path path = aside_path(directory, name, number);
    // The empty file reserves the name: of two editors, each has its own.
    const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kNewFileMode);
    if (fd < 0 && errno == EEXIST) continue;
    if (fd < 0) return failed(path, "cannot be written");
    close(fd);
    if (auto written = replace_file(path, text); !written) {
      unlink(path.c_str());
      return fail(written.error());
    }
    return path;
  }
  return fail(
      Error{.message = "so many texts are kept beside it already; remove what is not needed",
            .file = aside_path(directory, name, 1).string()});
}

}  // namespace

Result<std::filesystem::path> keep_aside(const std::filesystem::path& directory,
                                         const std::string& name, std::string_view text) {
  auto kept = keep_in(directory, name, text);
  if (kept) return kept;
  std::error_code error;
  const auto elsewhere = std::filesystem::temp_directory_path(error);
  if (error) return kept;
  auto kept_elsewhere = keep_in(elsewhere, name, text);
  return kept_elsewhere ? kept_elsewhere : kept;
}

std::vector<std::filesystem::path> kept_aside(const std::filesystem::path& directory,
                                              const std::string& name) {
  std::vector<std::filesystem::path> kept;
  std::error_code error;
  for (int number = 1; number <= kMaxKept; ++number) {
    std::filesystem::path path = aside_path(directory, name, number);
    if (std::filesystem::exists(path, error)) kept.push_back(std::move(path));
  }
  return kept;
}

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
