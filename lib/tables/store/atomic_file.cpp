#include "tables/store/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
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

std::filesystem::path directory_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : ".";
}

// A dot in front: no table's name begins with it, so what a crash leaves behind is never taken for
// one.
std::string temporary_prefix(const std::filesystem::path& path) {
  return "." + path.filename().string() + ".";
}

// The file itself, also of a link to a link.
Result<std::filesystem::path> behind_links(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_symlink(path, error)) return path;
  auto target = std::filesystem::canonical(path, error);
  if (!error) return target;
  return fail(Error{.message = "is a link to nothing; remove it or make what it leads to",
                    .file = path.string()});
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
  const auto target = behind_links(path);
  if (!target) return fail(target.error());
  const std::filesystem::path directory = directory_of(*target);
  struct stat old{};
  const bool replaces = stat(target->c_str(), &old) == 0;
  std::string temporary = (directory / (temporary_prefix(*target) + "XXXXXX")).string();
  const int fd = mkostemp(temporary.data(), O_CLOEXEC);
  if (fd < 0) return failed(path, "cannot be written");
  const mode_t mode = replaces ? old.st_mode & 07777 : kNewFileMode;
  // Only root may give files away: others keep what they can. Before the mode, which it may change.
  if (replaces && fchown(fd, old.st_uid, old.st_gid) != 0) (void)!fchown(fd, -1U, old.st_gid);
  const bool written = fchmod(fd, mode) == 0 && write_all(fd, text) && fsync(fd) == 0;
  const int cause = errno;
  const bool closed = close(fd) == 0;
  if (written && closed && rename(temporary.c_str(), target->c_str()) == 0) {
    if (!sync_directory(directory)) return failed(path, "cannot be synced to the disk");
    return {};
  }
  if (!written) errno = cause;
  const auto error = failed(path, "cannot be written");
  unlink(temporary.c_str());
  return error;
}

void remove_leftovers(const std::filesystem::path& path) {
  const auto target = behind_links(path);
  if (!target) return;
  const std::string prefix = temporary_prefix(*target);
  std::error_code error;
  std::vector<std::filesystem::path> leftovers;
  for (std::filesystem::directory_iterator entry(directory_of(*target), error), end;
       !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    // Six letters or digits; ".t.toml.backup" is six letters too, but nobody makes such names.
    const bool random = name.size() == prefix.size() + 6 &&
                        std::all_of(name.end() - 6, name.end(),
                                    [](unsigned char c) { return std::isalnum(c) != 0; });
    if (random && name.starts_with(prefix)) leftovers.push_back(entry->path());
  }
  for (const auto& leftover : leftovers) std::filesystem::remove(leftover, error);
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
