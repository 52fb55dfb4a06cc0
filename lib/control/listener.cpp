#include "control/listener.h"

#include <grp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace bushd::control {
namespace {

constexpr int kBacklog = 256;

Error system_error(const std::string& what, const std::string& path) {
  return {.message = what + ": " + std::strerror(errno), .file = path};
}

// Closed unless it is released.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }

 private:
  int fd_;
};

// Those that are missing, each so that others can look into it.
Result<void> make_folders(const std::filesystem::path& folder) {
  std::error_code error;
  if (folder.empty() || std::filesystem::is_directory(folder, error)) return {};
  if (folder.has_parent_path() && folder.parent_path() != folder) {
    if (auto made = make_folders(folder.parent_path()); !made) return made;
  }
  if (std::filesystem::create_directory(folder, error)) {
    ::chmod(folder.c_str(), 0755);
    return {};
  }
  const std::string why = error.message();
  if (std::filesystem::is_directory(folder, error)) return {};
  return fail(
      Error{.message = "the folder of the control socket cannot be made: " +
                       (std::filesystem::exists(folder, error) ? "a file has its name" : why),
            .file = folder.string()});
}

Result<void> give_to_group(const std::string& path, const std::string& group) {
  if (group.empty()) return {};
  const struct group* entry = ::getgrnam(group.c_str());
  if (entry == nullptr) {
    return fail(Error{.message = "there is no group \"" + group +
                                 "\" of users; make it, or "
                                 "change [control] group",
                      .file = path});
  }
  // A service whose unit has that group needs no right to give files away, and may have none.
  struct stat status{};
  if (::stat(path.c_str(), &status) == 0 && status.st_gid == entry->gr_gid) return {};
  if (::chown(path.c_str(), static_cast<uid_t>(-1), entry->gr_gid) != 0) {
    Error error = system_error("the socket cannot be given to group " + group, path);
    error.message +=
        ". Started by systemd: 'systemctl edit bushd' with [Service] and Group=" + group +
        "; else the daemon's user has to be in that group";
    return fail(std::move(error));
  }
  return {};
}

Result<PidLock> take_lock(const std::string& path, const std::string& lock_path) {
  auto taken = PidLock::take(lock_path);
  if (!taken.holder.empty()) {
    return fail(Error{.message = "another daemon has this control socket, " + taken.holder +
                                 "; end it, or give this one another [control] path",
                      .file = path});
  }
  if (!taken.lock) {
    return fail(
        Error{.message = "the control socket cannot be made: " + taken.error, .file = lock_path});
  }
  return std::move(*taken.lock);
}

}  // namespace

Result<Listener> Listener::open(const std::string& path, const std::string& group) {
  Listener listener(path, group);
  if (auto made = listener.make(); !made) return fail(made.error());
  return listener;
}

Listener::Listener(Listener&& other) noexcept
    : path_(other.path_),
      group_(other.group_),
      lock_(std::move(other.lock_)),
      fd_(std::exchange(other.fd_, -1)),
      device_(other.device_),
      inode_(other.inode_) {}

Listener::~Listener() {
  if (fd_ < 0) return;
  if (in_place()) ::unlink(path_.c_str());
  ::close(fd_);
}

bool Listener::in_place() const {
  struct stat status{};
  return ::stat(path_.c_str(), &status) == 0 && S_ISSOCK(status.st_mode) &&
         status.st_dev == device_ && status.st_ino == inode_;
}

Result<void> Listener::restore() {
  return make();
}

Result<void> Listener::make() {
  sockaddr_un address{};
  if (path_.size() >= sizeof address.sun_path) {
    return fail(Error{.message = "the path of the control socket is too long", .file = path_});
  }
  if (auto made = make_folders(std::filesystem::path(path_).parent_path()); !made) return made;
  // Who holds the lock may replace a socket that a daemon has left behind.
  const std::string lock_path = path_ + ".lock";
  if (!lock_ || !lock_->is_at(lock_path)) {
    auto taken = take_lock(path_, lock_path);
    if (!taken) return fail(taken.error());
    lock_.emplace(std::move(*taken));
  }
  Descriptor listener(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (listener.get() < 0) return fail(system_error("the control socket cannot be made", path_));
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path_.c_str(), path_.size());
  ::unlink(path_.c_str());
  const mode_t mask = ::umask(0177);
  const int bound =
      ::bind(listener.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  ::umask(mask);
  if (bound != 0) return fail(system_error("the control socket cannot be made", path_));
  if (auto given = give_to_group(path_, group_); !given) return given;
  struct stat status{};
  if (::chmod(path_.c_str(), 0660) != 0 || ::listen(listener.get(), kBacklog) != 0 ||
      ::stat(path_.c_str(), &status) != 0) {
    return fail(system_error("the control socket cannot be opened", path_));
  }
  if (fd_ >= 0) ::close(fd_);
  fd_ = listener.release();
  device_ = status.st_dev;
  inode_ = status.st_ino;
  return {};
}

}  // namespace bushd::control
