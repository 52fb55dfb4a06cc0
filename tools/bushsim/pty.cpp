#include "pty.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>

namespace bushsim {
namespace {

using bushd::fail;
using bushd::Result;

Result<void> make_link(const std::string& target, const std::string& link) {
  struct stat present{};
  if (::lstat(link.c_str(), &present) == 0 && !S_ISLNK(present.st_mode)) {
    return fail({.message = "is there and no symlink, so it is left alone; give another --link",
                 .file = link});
  }
  const std::string fresh = link + ".bushsim-" + std::to_string(::getpid());
  if (::symlink(target.c_str(), fresh.c_str()) != 0) {
    auto error =
        system_error("the link cannot be made; give a --link in a folder you may write to");
    error.file = link;
    return fail(error);
  }
  if (::rename(fresh.c_str(), link.c_str()) != 0) {
    auto error = system_error("the link cannot be put in place");
    error.file = link;
    ::unlink(fresh.c_str());
    return fail(error);
  }
  return {};
}

}  // namespace

Pty::Pty(Descriptor master, Descriptor slave, std::string slave_path, std::string link)
    : master_(std::move(master)),
      slave_(std::move(slave)),
      slave_path_(std::move(slave_path)),
      link_(std::move(link)) {}

Result<Pty> Pty::open(const std::string& link) {
  Descriptor master(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!master.valid()) return fail(system_error("no pty can be had"));
  std::array<char, PATH_MAX> name{};
  if (::grantpt(master.get()) != 0 || ::unlockpt(master.get()) != 0 ||
      ::ptsname_r(master.get(), name.data(), name.size()) != 0) {
    return fail(system_error("the pty cannot be set up"));
  }
  Descriptor slave(::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  termios settings{};
  if (!slave.valid() || ::tcgetattr(slave.get(), &settings) != 0) {
    return fail(system_error(std::string("the slave ") + name.data() + " cannot be opened"));
  }
  ::cfmakeraw(&settings);
  if (::tcsetattr(slave.get(), TCSANOW, &settings) != 0) {
    return fail(system_error(std::string("the slave ") + name.data() + " cannot be made raw"));
  }
  if (const auto linked = make_link(name.data(), link); !linked) return fail(linked.error());
  return Pty(std::move(master), std::move(slave), name.data(), link);
}

Pty::~Pty() {
  if (!master_.valid()) return;  // moved from
  std::array<char, PATH_MAX> target{};
  const ssize_t size = ::readlink(link_.c_str(), target.data(), target.size());
  if (size > 0 && slave_path_ == std::string(target.data(), static_cast<std::size_t>(size))) {
    ::unlink(link_.c_str());
  }
}

Result<std::size_t> Pty::read(std::span<std::uint8_t> space) {
  const ssize_t size = ::read(master_.get(), space.data(), space.size());
  if (size >= 0) return static_cast<std::size_t>(size);
  if (errno == EAGAIN || errno == EINTR) return 0;
  return fail(system_error("the pty cannot be read"));
}

Result<std::size_t> Pty::write(std::span<const std::uint8_t> bytes) {
  const ssize_t size = ::write(master_.get(), bytes.data(), bytes.size());
  if (size >= 0) return static_cast<std::size_t>(size);
  if (errno == EAGAIN || errno == EINTR) return 0;
  return fail(system_error("the pty cannot be written"));
}

void Pty::lift_exclusive_use() {
  ::ioctl(slave_.get(), TIOCNXCL);
}

}  // namespace bushsim
