// What `bushctl doctor` looks at, as plain values: whoever fills them in reads the system, whoever
// judges them (diagnosis.h) does not.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "api/snapshot.h"
#include "client/status.h"

namespace bushctl::doctor {

struct User {
  std::string name{};
  std::uint32_t uid = 0;
  std::vector<std::uint32_t> groups{};  // of its processes as they are now
  bool is_root() const { return uid == 0; }
};

// Owner and mode of a file, as stat(2) tells.
struct Rights {
  std::uint32_t uid = 0;
  std::uint32_t gid = 0;
  std::uint32_t mode = 0;
  std::string group{};  // its name, or the number
};

// A process that has something open, or has locked it.
struct Holder {
  std::int64_t pid = 0;
  std::string program{};
};

struct ConfigurationSeen {
  std::string path{};
  bool exists = false;
  Rights rights{};
  std::string error{};   // of reading and checking it and its tables; "": it is good
  std::string extent{};  // "2 buses, 3 MCUs, 32 motors"
  std::string sha256{};  // of its text
  bool lcm_commands = false;
  std::vector<std::string> with_home{};  // motors that can be homed
};

struct PortSeen {
  std::string bus{};         // whose port it is
  std::string configured{};  // as in bushd.toml: a path, or a pattern
  std::string path{};        // of what is there; "": nothing is
  std::string target{};      // where links lead to
  bool is_device = true;
  Rights rights{};
  std::optional<int> latency_timer_ms{};  // of FTDI adapters
  std::vector<Holder> holders{};          // as far as this user may see
};

struct UdpSocket {
  std::uint32_t port = 0;
  std::uint64_t queued_bytes = 0;
  std::uint64_t drops = 0;  // datagrams that had no room, or that the program's own filter refused
};

struct LcmSeen {
  std::string url{};
  bool multicast = true;  // the URL is one of udpm
  std::string address{};
  std::uint32_t port = 0;
  int ttl = 0;
  std::optional<std::string> device{};  // where the route leads to; none: there is no route
  std::uint64_t largest_buffer = 0;     // net.core.rmem_max; 0: unknown
  std::vector<UdpSocket> sockets{};     // those at `port`
  // Datagrams that found no room there while doctor looked.
  std::uint64_t lost_meanwhile = 0;
};

struct ClockSeen {
  std::int64_t unix_us = 0;
  std::optional<bool> synchronised{};  // as the kernel was told by NTP; none: it cannot be asked
};

struct FolderSeen {
  std::string what{};  // "state", "log of moves"
  std::string path{};
  bool exists = false;
  Rights rights{};
  std::uint64_t free_bytes = 0;
  std::uint64_t free_files = 0;
  bool counts_files = true;  // some file systems have no limit of their own
};

struct SocketSeen {
  enum class State { kAbsent, kNobodyListens, kNoRight, kListens };
  std::string path{};
  State state = State::kAbsent;
  std::string group{};               // that may use it
  bool is_member_elsewhere = false;  // the account is in that group, these processes are not yet
};

struct DaemonSeen {
  std::string unreachable{};  // why it does not answer; "": it does
  bool by_socket = true;
  std::string config_path{};  // what it has read, if it told
  std::string config_sha256{};
  std::int64_t unix_us = 0;  // this PC's clock when the state came
  bushd::client::Status status{};
  // Healths after `watched_s` seconds more.
  std::vector<bushd::api::HealthSnapshot> later{};
  double watched_s = 0;
};

struct Observations {
  User asking{};   // who runs doctor
  User serving{};  // the user whose rights the daemon has
  ConfigurationSeen configuration{};
  std::vector<PortSeen> ports{};
  std::vector<std::string> adapters{};  // serial adapters that are plugged in
  LcmSeen lcm{};
  ClockSeen clock{};
  std::vector<FolderSeen> folders{};
  std::vector<SocketSeen> sockets{};
  DaemonSeen daemon{};
};

// As they are now, by bus: the daemon publishes healths once a second, and those of the status may
// be from before.
inline std::vector<bushd::api::HealthSnapshot> newest_healths(const DaemonSeen& daemon) {
  if (!daemon.later.empty()) return daemon.later;
  std::vector<bushd::api::HealthSnapshot> healths;
  for (const auto& message : daemon.status.healths) healths.push_back(message.snapshot);
  return healths;
}

}  // namespace bushctl::doctor
