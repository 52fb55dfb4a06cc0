#include "observe_files.h"

#include <grp.h>
#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include "config/port_pattern.h"
#include "proc.h"

namespace bushctl::doctor {
namespace {

namespace fs = std::filesystem;

std::string group_name(gid_t gid) {
  const group* entry = getgrgid(gid);
  return entry == nullptr ? std::to_string(gid) : entry->gr_name;
}

Holder holder_of(std::int64_t pid) {
  Holder holder{.pid = pid, .program = text_of("/proc/" + std::to_string(pid) + "/comm")};
  while (holder.program.ends_with('\n')) holder.program.pop_back();
  return holder;
}

// Only root sees what processes of other users have open.
std::set<std::int64_t> who_has_open(const std::string& target) {
  std::set<std::int64_t> pids;
  std::error_code error;
  for (const auto& process : fs::directory_iterator("/proc", error)) {
    const std::string name = process.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    for (const auto& open : fs::directory_iterator(process.path() / "fd", error)) {
      if (fs::read_symlink(open.path(), error) == target) pids.insert(std::stoll(name));
    }
  }
  return pids;
}

}  // namespace

std::optional<FileSeen> file_at(const std::string& path) {
  struct stat status{};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return FileSeen{.rights = {.uid = status.st_uid,
                             .gid = status.st_gid,
                             .mode = status.st_mode,
                             .group = group_name(status.st_gid)},
                  .is_device = S_ISCHR(status.st_mode),
                  .device = status.st_dev,
                  .inode = status.st_ino};
}

std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<std::uint32_t> groups_of_account(const std::string& name) {
  const passwd* entry = getpwnam(name.c_str());
  if (entry == nullptr) return {};
  int count = 256;
  std::vector<gid_t> groups(static_cast<std::size_t>(count));
  if (getgrouplist(name.c_str(), entry->pw_gid, groups.data(), &count) < 0) {
    groups.resize(static_cast<std::size_t>(count));
    getgrouplist(name.c_str(), entry->pw_gid, groups.data(), &count);
  }
  return {groups.begin(), groups.begin() + count};
}

PortSeen port_seen(const std::string& bus, const std::string& configured,
                   const std::string& in_use) {
  PortSeen seen{.bus = bus, .configured = configured};
  for (const std::string& path :
       bushd::config::ports_matching(in_use.empty() ? configured : in_use)) {
    const auto file = file_at(path);
    if (!file) continue;
    std::error_code error;
    seen.path = path;
    seen.target = fs::canonical(path, error).string();
    seen.is_device = file->is_device;
    seen.rights = file->rights;
    auto pids = who_has_open(seen.target);
    for (const std::int64_t pid : lock_holders(text_of("/proc/locks"), major(file->device),
                                               minor(file->device), file->inode)) {
      pids.insert(pid);
    }
    for (const std::int64_t pid : pids) seen.holders.push_back(holder_of(pid));
    const std::string name = fs::path(seen.target).filename().string();
    int latency_ms = 0;
    if (std::istringstream(text_of("/sys/bus/usb-serial/devices/" + name + "/latency_timer")) >>
        latency_ms) {
      seen.latency_timer_ms = latency_ms;
    }
    break;
  }
  return seen;
}

SocketSeen socket_seen(const std::string& path, const User& asking) {
  using enum SocketSeen::State;
  SocketSeen seen{.path = path};
  sockaddr_un address{};
  if (path.size() >= sizeof address.sun_path) return seen;
  const auto file = file_at(path);
  if (!file) return seen;
  seen.group = file->rights.group;
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.c_str(), path.size());
  const int fd = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  if (fd < 0) return seen;
  const bool connected =
      ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  const int error = errno;
  ::close(fd);
  seen.state = connected ? kListens : error == EACCES ? kNoRight : kNobodyListens;
  if (seen.state == kNoRight) {
    const auto groups = groups_of_account(asking.name);
    seen.is_member_elsewhere = std::ranges::find(groups, file->rights.gid) != groups.end();
  }
  return seen;
}

}  // namespace bushctl::doctor
