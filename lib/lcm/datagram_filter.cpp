#include "lcm/datagram_filter.h"

#include <dirent.h>
#include <linux/filter.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>

namespace bushd::lcm {
namespace {

constexpr std::uint32_t kWholeMessage = 0x4C433032;  // "LC02"; a fragment has "LC03"
constexpr std::uint32_t kUdpHeaderBytes = 8;  // the filter sees the datagram from its UDP header on

int option(int fd, int name) {
  int value = -1;
  socklen_t size = sizeof value;
  return getsockopt(fd, SOL_SOCKET, name, &value, &size) == 0 ? value : -1;
}

// Behind magic and sequence number.
constexpr std::uint32_t kChannelAt = kUdpHeaderBytes + 8;
constexpr std::uint32_t kTakeAll = UINT32_MAX;

// Takes or drops the datagram if its channel is this one, byte by byte with the NUL behind it; else
// goes on behind. A datagram that ends before the channel does is dropped.
void append_channel(std::vector<sock_filter>& program, const std::string& channel,
                    std::uint32_t verdict) {
  const std::size_t bytes = channel.size() + 1;
  for (std::size_t i = 0; i < bytes; ++i) {
    const auto at = static_cast<std::uint32_t>(kChannelAt + i);
    // From here over the comparisons that are left, and what takes the datagram.
    const auto beyond = static_cast<std::uint8_t>(2 * (bytes - 1 - i) + 1);
    const auto byte = static_cast<std::uint8_t>(channel.c_str()[i]);
    program.push_back(BPF_STMT(BPF_LD | BPF_B | BPF_ABS, at));
    program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, byte, 0, beyond));
  }
  program.push_back(BPF_STMT(BPF_RET | BPF_K, verdict));
}

}  // namespace

std::set<int> udp_sockets() {
  std::set<int> found;
  const std::unique_ptr<DIR, int (*)(DIR*)> directory(opendir("/proc/self/fd"), closedir);
  if (!directory) return found;
  while (const dirent* entry = readdir(directory.get())) {
    int fd = -1;
    std::from_chars(entry->d_name, entry->d_name + std::strlen(entry->d_name), fd);
    if (fd >= 0 && option(fd, SO_TYPE) == SOCK_DGRAM && option(fd, SO_DOMAIN) == AF_INET) {
      found.insert(fd);
    }
  }
  return found;
}

Result<void> accept_whole_messages_only(int udp_socket, const std::vector<std::string>& channels,
                                        const std::vector<std::string>& unheard) {
  std::vector<sock_filter> program{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kUdpHeaderBytes),  // a shorter datagram is dropped here
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kWholeMessage, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, 0),
  };
  for (const std::string& channel : unheard) append_channel(program, channel, 0);
  for (const std::string& channel : channels) append_channel(program, channel, kTakeAll);
  program.push_back(BPF_STMT(BPF_RET | BPF_K, channels.empty() ? kTakeAll : 0));
  const sock_fprog filter{.len = static_cast<unsigned short>(program.size()),
                          .filter = program.data()};
  if (setsockopt(udp_socket, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter) != 0) {
    return fail(std::string("cannot filter LCM's datagrams: ") + std::strerror(errno));
  }
  return {};
}

}  // namespace bushd::lcm
