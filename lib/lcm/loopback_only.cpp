#include "lcm/loopback_only.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <string_view>

namespace bushd::lcm {
namespace {

constexpr std::string_view kScheme = "udpm://";
constexpr const char* kAddress = "239.255.76.67";
constexpr std::uint16_t kPort = 7667;

int number(std::string_view text, int fallback) {
  int value = fallback;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

tl::unexpected<Error> cannot(const char* what) {
  return fail(std::string("LCM's packets cannot be kept on this PC: ") + what + ": " +
              std::strerror(errno));
}

bool is_bound_to(int fd, std::uint16_t port) {
  sockaddr_in bound{};
  socklen_t size = sizeof bound;
  return ::getsockname(fd, reinterpret_cast<sockaddr*>(&bound), &size) == 0 &&
         ntohs(bound.sin_port) == port;
}

}  // namespace

std::optional<MulticastUrl> multicast_url(const std::string& url) {
  if (!url.starts_with(kScheme)) return std::nullopt;
  const std::string_view rest = std::string_view(url).substr(kScheme.size());
  const std::string_view place = rest.substr(0, rest.find('?'));
  const std::size_t colon = place.find(':');
  MulticastUrl out{.address = std::string(place.substr(0, colon)), .port = kPort};
  if (out.address.empty()) out.address = kAddress;
  if (colon != std::string_view::npos) {
    out.port = static_cast<std::uint16_t>(number(place.substr(colon + 1), kPort));
  }
  const std::size_t ttl = rest.find("ttl=");
  if (ttl != std::string_view::npos) out.ttl = number(rest.substr(ttl + 4), 0);
  return out;
}

Result<void> keep_on_loopback(int udp_socket, const MulticastUrl& url) {
  const in_addr loopback{.s_addr = htonl(INADDR_LOOPBACK)};
  if (::setsockopt(udp_socket, IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof loopback) != 0) {
    return cannot("IP_MULTICAST_IF");
  }
  if (!is_bound_to(udp_socket, url.port)) return {};
  ip_mreq membership{};
  if (::inet_aton(url.address.c_str(), &membership.imr_multiaddr) == 0) return {};
  membership.imr_interface = loopback;
  const bool joined =
      ::setsockopt(udp_socket, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) == 0;
  if (!joined && errno != EADDRINUSE) return cannot("IP_ADD_MEMBERSHIP");
  if (joined) {
    // LCM has joined where the route leads to now.
    membership.imr_interface.s_addr = htonl(INADDR_ANY);
    static_cast<void>(
        ::setsockopt(udp_socket, IPPROTO_IP, IP_DROP_MEMBERSHIP, &membership, sizeof membership));
  }
  // Else a socket hears what others of this PC have joined at other devices.
  const int own_groups_only = 0;
  if (::setsockopt(udp_socket, IPPROTO_IP, IP_MULTICAST_ALL, &own_groups_only,
                   sizeof own_groups_only) != 0) {
    return cannot("IP_MULTICAST_ALL");
  }
  return {};
}

}  // namespace bushd::lcm
