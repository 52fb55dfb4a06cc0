// LCM's packets stay on this PC where the URL says ttl=0.
//
// A TTL of 0 does not do it: Linux holds such a packet back only where a program of this PC has
// joined the group at the device that the route names (ip_mc_output). When the route to lo goes,
// LCM has joined at lo and sends by another device, so all of the network hears it
// (lcm-proj/lcm#158).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/result.h"

namespace bushd::lcm {

// "udpm://239.255.76.67:7667?ttl=0", with LCM's defaults for what is left out. Nothing for other
// URLs.
struct MulticastUrl {
  std::string address{};
  std::uint16_t port = 0;
  int ttl = 0;
};
std::optional<MulticastUrl> multicast_url(const std::string& url);

// The socket sends by lo, and the one that is bound to the port hears the group at lo and nowhere
// else, wherever the route leads to, now and later.
Result<void> keep_on_loopback(int udp_socket, const MulticastUrl& url);

}  // namespace bushd::lcm
