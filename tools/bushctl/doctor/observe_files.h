// Files, ports, sockets and processes as the system shows them to this user.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "observations.h"

namespace bushctl::doctor {

struct FileSeen {
  Rights rights{};
  bool is_device = false;
  std::uint64_t device = 0;  // of the file system it is on
  std::uint64_t inode = 0;
};
// Behind links; nothing if there is none or it may not be seen.
std::optional<FileSeen> file_at(const std::string& path);

// The whole of a file; "" if it cannot be read.
std::string text_of(const std::string& path);

// As a new login of that account would have them.
std::vector<std::uint32_t> groups_of_account(const std::string& name);

// `in_use`: the match of a pattern that the daemon has open, or "".
PortSeen port_seen(const std::string& bus, const std::string& configured,
                   const std::string& in_use);
SocketSeen socket_seen(const std::string& path, const User& asking);

}  // namespace bushctl::doctor
