// Files of /proc, as text: what of them doctor needs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "observations.h"

namespace bushctl::doctor {

// The network device that /proc/net/route, with this text, gives packets to this address; the
// longest prefix wins, then the lowest metric. `address`: "239.255.76.67".
std::optional<std::string> route_to(std::string_view text, const std::string& address);

// How many datagrams of all programs found no room since this network exists (Udp: RcvbufErrors),
// of /proc/net/snmp. What a socket's own filter refuses is not among them.
std::uint64_t datagrams_without_room(std::string_view text);

// Sockets of /proc/net/udp at this port.
std::vector<UdpSocket> udp_sockets(std::string_view text, std::uint32_t port);

// Processes that have locked the whole of this file, out of /proc/locks.
std::vector<std::int64_t> lock_holders(std::string_view text, std::uint32_t device_major,
                                       std::uint32_t device_minor, std::uint64_t inode);

// "udpm://239.255.76.67:7667?ttl=1": its parts, with LCM's defaults for what is left out. Others:
// `multicast` is false.
LcmSeen lcm_of(const std::string& url);

}  // namespace bushctl::doctor
