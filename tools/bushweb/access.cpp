#include "access.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <cctype>

namespace bushweb {
namespace {

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

// "[::1]:80" -> "::1", "pc.lab:80" -> "pc.lab".
std::string without_port(std::string_view host) {
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    return std::string(host.substr(1, end == std::string_view::npos ? end : end - 1));
  }
  return std::string(host.substr(0, host.find(':')));
}

bool is_numeric(int family, const std::string& text) {
  std::array<unsigned char, sizeof(in6_addr)> address;
  return inet_pton(family, text.c_str(), address.data()) == 1;
}

}  // namespace

bool is_address(std::string_view host) {
  const std::string name = without_port(host);
  return is_numeric(host.starts_with('[') ? AF_INET6 : AF_INET, name);
}

bool is_loopback(std::string_view address) {
  constexpr std::string_view kMapped = "::ffff:";
  if (address.starts_with(kMapped)) address.remove_prefix(kMapped.size());
  return address == "::1" ||
         (address.starts_with("127.") && is_numeric(AF_INET, std::string(address)));
}

std::string why_not_host(const Visit& visit, const AccessOptions& options) {
  const std::string name = lower(without_port(visit.host));
  if (is_address(visit.host) || name == "localhost") return "";
  if (std::ranges::find(options.hosts, name) != options.hosts.end()) return "";
  if (visit.host.empty()) return "a request without Host is not answered";
  return "bushd-web does not answer to this name of its PC: use its address, or start it with "
         "--host NAME";
}

bool is_foreign(const Visit& visit, const AccessOptions& options) {
  if (visit.origin.empty()) return false;
  const std::size_t scheme = visit.origin.find("://");
  if (scheme == std::string::npos) return true;
  const bool secure = options.tls || options.behind_proxy;
  if (secure && lower(visit.origin.substr(0, scheme)) != "https") return true;
  return lower(visit.origin.substr(scheme + 3)) != lower(visit.host);
}

std::string token_of(std::string_view cookies) {
  while (!cookies.empty()) {
    const std::size_t end = std::min(cookies.find(';'), cookies.size());
    std::string_view cookie = cookies.substr(0, end);
    cookies.remove_prefix(std::min(end + 1, cookies.size()));
    while (cookie.starts_with(' ')) cookie.remove_prefix(1);
    if (!cookie.starts_with(kCookie)) continue;
    cookie.remove_prefix(kCookie.size());
    if (cookie.starts_with('=')) return std::string(cookie.substr(1));
  }
  return "";
}

Rights rights_of(const Visit& visit, const std::optional<std::string>& user,
                 const AccessOptions& options) {
  Rights rights{.user = user, .may_command = user.has_value(), .may_stop = user.has_value()};
  const bool here = is_loopback(visit.peer) && !options.behind_proxy;
  if (options.stops == WhoStops::kAnyone || (options.stops == WhoStops::kLoopback && here)) {
    rights.may_stop = true;
  }
  return rights;
}

}  // namespace bushweb
