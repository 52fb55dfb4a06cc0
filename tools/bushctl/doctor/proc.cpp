#include "proc.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <sstream>

#include "base/parse_number.h"

namespace bushctl::doctor {
namespace {

using bushd::parse_number;

constexpr std::string_view kScheme = "udpm://";
constexpr const char* kAddress = "239.255.76.67";
constexpr std::uint32_t kPort = 7667;

// The words of each line but the first, which has their names.
std::vector<std::vector<std::string>> rows(std::string_view text) {
  std::vector<std::vector<std::string>> out;
  std::istringstream lines{std::string(text)};
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    std::istringstream words(line);
    std::vector<std::string> row;
    for (std::string word; words >> word;) row.push_back(word);
    out.push_back(std::move(row));
  }
  return out;
}

}  // namespace

std::optional<std::string> route_to(std::string_view text, const std::string& address) {
  // As the kernel prints it: the number that the four bytes are on this machine.
  in_addr wanted{};
  if (inet_pton(AF_INET, address.c_str(), &wanted) != 1) return std::nullopt;
  constexpr std::uint32_t kUp = 1;
  constexpr std::uint32_t kReject = 0x200;
  std::optional<std::string> device;
  std::uint32_t best_mask = 0;
  std::uint32_t best_metric = 0;
  // Iface Destination Gateway Flags RefCnt Use Metric Mask ...
  for (const auto& row : rows(text)) {
    if (row.size() < 8) continue;
    const auto destination = parse_number<std::uint32_t>(row[1], 16);
    const auto flags = parse_number<std::uint32_t>(row[3], 16);
    const auto metric = parse_number<std::uint32_t>(row[6], 10);
    const auto mask = parse_number<std::uint32_t>(row[7], 16);
    if (!destination || !flags || !metric || !mask) continue;
    if ((*flags & kUp) == 0 || (*flags & kReject) != 0) continue;
    if ((wanted.s_addr & *mask) != *destination) continue;
    const std::uint32_t length = ntohl(*mask);
    const bool better =
        !device || length > best_mask || (length == best_mask && *metric < best_metric);
    if (!better) continue;
    device = row[0];
    best_mask = length;
    best_metric = *metric;
  }
  return device;
}

std::uint64_t datagrams_without_room(std::string_view text) {
  // A line of names, then one of numbers, each behind the name of the protocol.
  std::istringstream lines{std::string(text)};
  std::vector<std::string> names;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::vector<std::string> row;
    for (std::string word; words >> word;) row.push_back(word);
    if (row.empty() || row.front() != "Udp:") continue;
    if (names.empty()) {
      names = std::move(row);
      continue;
    }
    const auto place = std::ranges::find(names, "RcvbufErrors") - names.begin();
    if (static_cast<std::size_t>(place) >= row.size()) return 0;
    return parse_number<std::uint64_t>(row[static_cast<std::size_t>(place)], 10).value_or(0);
  }
  return 0;
}

std::vector<UdpSocket> udp_sockets(std::string_view text, std::uint32_t port) {
  std::vector<UdpSocket> out;
  // sl local_address rem_address st tx_queue:rx_queue tr:tm->when retrnsmt uid timeout inode ref
  // pointer drops
  for (const auto& row : rows(text)) {
    if (row.size() < 13) continue;
    const auto colon = row[1].find(':');
    const auto queues = row[4].find(':');
    if (colon == std::string::npos || queues == std::string::npos) continue;
    const auto local = parse_number<std::uint32_t>(std::string_view(row[1]).substr(colon + 1), 16);
    const auto queued =
        parse_number<std::uint64_t>(std::string_view(row[4]).substr(queues + 1), 16);
    const auto drops = parse_number<std::uint64_t>(row[12], 10);
    if (!local || !queued || !drops || *local != port) continue;
    out.push_back({.port = port, .queued_bytes = *queued, .drops = *drops});
  }
  return out;
}

std::vector<std::int64_t> lock_holders(std::string_view text, std::uint32_t device_major,
                                       std::uint32_t device_minor, std::uint64_t inode) {
  std::array<char, 64> place{};
  std::snprintf(place.data(), place.size(), "%02x:%02x:%llu", device_major, device_minor,
                static_cast<unsigned long long>(inode));
  std::vector<std::int64_t> out;
  // 1: FLOCK ADVISORY WRITE 4711 00:05:90 0 EOF; one that waits has "->" behind its number.
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string number_of, kind, advisory, access, pid, file;
    words >> number_of >> kind >> advisory >> access >> pid >> file;
    if (kind == "->" || file != place.data()) continue;
    if (const auto holder = parse_number<std::int64_t>(pid, 10); holder && *holder > 0) {
      out.push_back(*holder);
    }
  }
  return out;
}

LcmSeen lcm_of(const std::string& url) {
  LcmSeen lcm{.url = url, .multicast = url.starts_with(kScheme)};
  if (!lcm.multicast) return lcm;
  const std::string rest = url.substr(kScheme.size());
  const std::string place = rest.substr(0, rest.find('?'));
  const auto colon = place.find(':');
  lcm.address = place.empty() ? kAddress : place.substr(0, colon);
  const auto port = colon == std::string::npos ? std::nullopt
                                               : parse_number<std::uint32_t>(
                                                     std::string_view(place).substr(colon + 1), 10);
  lcm.port = port.value_or(kPort);
  if (const auto ttl = rest.find("ttl="); ttl != std::string::npos) {
    const std::string digits = rest.substr(ttl + 4, rest.find('&', ttl) - (ttl + 4));
    lcm.ttl = parse_number<int>(digits, 10).value_or(0);
  }
  return lcm;
}

}  // namespace bushctl::doctor
