// Who may what: decided from what a browser says of itself and where it connects from. No I/O.
//
// TCP tells nobody who asks. So everybody who reaches the port may look, and who has a token may
// command. A page of somebody else's in the same browser reaches the port as well: it is told
// apart by Host (a name of somebody else's that leads here) and Origin.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "messages.h"

namespace bushweb {

// A request over HTTP, as it came; a header that is not there is "".
struct Visit {
  std::string method{};
  std::string path{};
  std::string daemon{};  // ?daemon=
  std::string host{};
  std::string origin{};
  std::string cookies{};
  std::string peer{};  // its address
  bool takes_gzip = false;
  std::string body{};
};

enum class WhoStops { kNobody, kLoopback, kAnyone };  // without a token

struct AccessOptions {
  std::vector<std::string> hosts{};  // names by which pages may call this PC, lower case
  bool behind_proxy = false;         // the peer is the proxy, whoever is behind it
  bool tls = false;
  WhoStops stops = WhoStops::kLoopback;
};

inline constexpr std::string_view kCookie = "bushd_web";

// Why a request is not answered, whatever it asks for; "": it is.
std::string why_not_host(const Visit& visit, const AccessOptions& options);
// What changes something is to come from a page of ours. Programs that are no browsers name no
// origin. Where pages have TLS, one without is somebody else's too.
bool is_foreign(const Visit& visit, const AccessOptions& options);

// "127.0.0.1" and its like, "::1".
bool is_loopback(std::string_view address);
// An address, with a port or without: no name leads to it.
bool is_address(std::string_view host);

// The token in the cookies; "": there is none.
std::string token_of(std::string_view cookies);

// `user`: who has the token of this visit.
Rights rights_of(const Visit& visit, const std::optional<std::string>& user,
                 const AccessOptions& options);

}  // namespace bushweb
