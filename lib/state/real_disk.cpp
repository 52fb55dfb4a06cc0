#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

#include "state/disk.h"

namespace bushd::state {
namespace {

constexpr mode_t kFileMode = 0644;

tl::unexpected<Error> failed(const std::filesystem::path& path, const char* what) {
  return fail(Error{.message = std::string(what) + ": " + std::strerror(errno), .file = path});
}

class RealFile final : public File {
 public:
  RealFile(int fd, std::filesystem::path path) : fd_(fd), path_(std::move(path)) {}
  ~RealFile() override { ::close(fd_); }
  RealFile(const RealFile&) = delete;
  RealFile& operator=(const RealFile&) = delete;

  Result<std::uint64_t> size() override {
    struct stat status{};
    if (::fstat(fd_, &status) != 0) return failed(path_, "cannot be looked at");
    return static_cast<std::uint64_t>(status.st_size);
  }

  Result<void> read(std::uint64_t offset, std::span<std::uint8_t> bytes) override {
    while (!bytes.empty()) {
      const ssize_t got = ::pread(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) return failed(path_, "cannot be read");
      if (got == 0) break;
      offset += static_cast<std::uint64_t>(got);
      bytes = bytes.subspan(static_cast<std::size_t>(got));
    }
    for (std::uint8_t& beyond : bytes) beyond = 0;
    return {};
  }

  Result<void> write(std::uint64_t offset, std::span<const std::uint8_t> bytes) override {
    while (!bytes.empty()) {
      const ssize_t put = ::pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
      if (put < 0 && errno == EINTR) continue;
      if (put <= 0) return failed(path_, "cannot be written");
      offset += static_cast<std::uint64_t>(put);
      bytes = bytes.subspan(static_cast<std::size_t>(put));
    }
    return {};
  }

  Result<void> sync() override {
    if (::fdatasync(fd_) == 0) return {};
    return failed(path_, "cannot be synced to the disk");
  }

 private:
  int fd_;
  std::filesystem::path path_;
};

class RealDisk final : public Disk {
 public:
  Result<void> make_folder(const std::filesystem::path& folder) override {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!error) return {};
    return fail(Error{.message = "cannot be made: " + error.message(), .file = folder});
  }

  Result<std::unique_ptr<File>> open(const std::filesystem::path& path) override {
    const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kFileMode);
    if (fd < 0) return failed(path, "cannot be opened");
    return std::make_unique<RealFile>(fd, path);
  }

  bool exists(const std::filesystem::path& path) override {
    std::error_code error;
    return std::filesystem::exists(path, error);
  }

  Result<void> rename(const std::filesystem::path& from, const std::filesystem::path& to) override {
    if (::rename(from.c_str(), to.c_str()) == 0) return {};
    return failed(from, "cannot be moved aside");
  }

  Result<void> remove(const std::filesystem::path& path) override {
    if (::unlink(path.c_str()) == 0) return {};
    return failed(path, "cannot be removed");
  }

  Result<void> sync_folder(const std::filesystem::path& folder) override {
    const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0) return failed(folder, "cannot be opened");
    const bool synced = ::fsync(fd) == 0;
    const auto error = failed(folder, "cannot be synced to the disk");
    ::close(fd);
    if (synced) return {};
    return error;
  }

  const char* vfs() const override { return nullptr; }
};

}  // namespace

Disk& real_disk() {
  static RealDisk disk;
  return disk;
}

}  // namespace bushd::state
