#include "observe.h"

#include <fmt/format.h>
#include <pwd.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "../adapters.h"
#include "../commands.h"
#include "client/answer.h"
#include "config/config.h"
#include "control/path.h"
#include "observe_files.h"
#include "proc.h"
#include "tables/toml_file.h"

namespace bushctl::doctor {
namespace {

namespace api = bushd::api;
namespace fs = std::filesystem;
using bushd::client::Client;
using bushd::client::detail_of;

constexpr const char* kServiceUser = "bushd";
constexpr const char* kSystemFolder = "/etc/bushd/";
constexpr const char* kStateFolder = "/var/lib/bushd";
constexpr const char* kLogFolder = "/var/log/bushd";
constexpr std::chrono::milliseconds kDoctorPatience{4000};

User asking_user() {
  User user{.uid = geteuid()};
  std::vector<gid_t> groups(static_cast<std::size_t>(std::max(getgroups(0, nullptr), 0)));
  groups.resize(static_cast<std::size_t>(
      std::max(getgroups(static_cast<int>(groups.size()), groups.data()), 0)));
  user.groups.assign(groups.begin(), groups.end());
  user.groups.push_back(getegid());
  const passwd* entry = getpwuid(user.uid);
  user.name = entry == nullptr ? fmt::format("uid {}", user.uid) : entry->pw_name;
  return user;
}

// The daemon of a configuration of the system is that of the unit; others are started by hand.
User serving_user(const std::string& config_path, const User& asking) {
  const passwd* entry = config_path.starts_with(kSystemFolder) ? getpwnam(kServiceUser) : nullptr;
  if (entry == nullptr) return asking;
  return {.name = kServiceUser, .uid = entry->pw_uid, .groups = groups_of_account(kServiceUser)};
}

std::string counted(std::size_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

ConfigurationSeen configuration_of(const std::string& path,
                                   const bushd::Result<bushd::config::Config>& config) {
  ConfigurationSeen seen{.path = path};
  std::error_code error;
  seen.exists = fs::exists(path, error) || error;
  if (const auto file = file_at(path)) seen.rights = file->rights;
  if (!config) {
    seen.error = config.error().text();
    return seen;
  }
  seen.path = config->absolute_path;
  seen.extent = fmt::format("{} on {} and {}", counted(config->motors.size(), "motor", "motors"),
                            counted(config->mcus.size(), "MCU", "MCUs"),
                            counted(config->buses.size(), "bus", "buses"));
  seen.sha256 = config->text_sha256;
  seen.lcm_commands = config->lcm.commands;
  for (const auto& motor : config->motors) {
    if (motor.home) seen.with_home.push_back(motor.name);
  }
  return seen;
}

LcmSeen lcm_seen(const std::string& url) {
  LcmSeen seen = lcm_of(url);
  if (!seen.multicast) return seen;
  seen.device = route_to(text_of("/proc/net/route"), seen.address);
  seen.sockets = udp_sockets(text_of("/proc/net/udp"), seen.port);
  std::istringstream(text_of("/proc/sys/net/core/rmem_max")) >> seen.largest_buffer;
  return seen;
}

ClockSeen clock_seen() {
  ClockSeen seen{.unix_us = unix_us()};
  timex asked{};  // no modes: nothing is changed
  const int state = adjtimex(&asked);
  if (state >= 0) seen.synchronised = state != TIME_ERROR && (asked.status & STA_UNSYNC) == 0;
  return seen;
}

// The folder itself, or the one in which it would be made.
FolderSeen folder_seen(const std::string& what, fs::path path) {
  std::error_code error;
  while (!fs::exists(path, error) && path.has_relative_path()) path = path.parent_path();
  FolderSeen seen{.what = what, .path = path.empty() ? "." : path.string()};
  if (const auto file = file_at(seen.path)) {
    seen.exists = true;
    seen.rights = file->rights;
  }
  struct statvfs system{};
  if (statvfs(seen.path.c_str(), &system) == 0) {
    seen.free_bytes = std::uint64_t{system.f_bavail} * system.f_frsize;
    seen.free_files = system.f_favail;
    seen.counts_files = system.f_files > 0;
  }
  return seen;
}

std::vector<FolderSeen> folders_of(const bushd::Result<bushd::config::Config>& config) {
  std::vector<FolderSeen> out;
  std::error_code error;
  if (config && config->state.path && !config->state.path->empty()) {
    out.push_back(folder_seen("state", *config->state.path));
  } else if (config && !config->state.path && fs::is_directory(kStateFolder, error)) {
    out.push_back(folder_seen("state", kStateFolder));
  }
  if (fs::is_directory(kLogFolder, error)) out.push_back(folder_seen("log of moves", kLogFolder));
  return out;
}

std::vector<std::string> socket_paths(const bushd::client::ClientOptions& options,
                                      const bushd::Result<bushd::config::Config>& config) {
  if (!options.socket.empty()) return {options.socket};
  if (const char* path = std::getenv("BUSHD_CONTROL"); path != nullptr && *path != '\0') {
    return {path};
  }
  if (config && config->control.path) {
    if (config->control.path->empty()) return {};
    return {*config->control.path};
  }
  return bushd::control::default_paths();
}

// What it has read, and as what.
void ask_for_configuration(Client& client, DaemonSeen& seen) {
  const auto reply = client.run(api::Configure{}, Client::Until::kResult);
  const auto* configuration = detail_of<api::Configuration>(reply);
  if (configuration == nullptr) return;
  seen.config_path = configuration->path;
  seen.config_sha256 = configuration->sha256;
}

DaemonSeen daemon_seen(const Scope& scope) {
  DaemonSeen seen;
  const auto client = Client::open(scope.client);
  if (!client) {
    seen.unreachable = client.error().text();
    return seen;
  }
  seen.by_socket = !(*client)->link().loses();
  auto status = (*client)->status(kDoctorPatience);
  if (!status) {
    seen.unreachable = status.error().text();
    return seen;
  }
  seen.unix_us = unix_us();
  seen.status = std::move(*status);
  if (seen.by_socket) ask_for_configuration(**client, seen);
  const auto began = Client::Clock::now();
  const auto end = began + std::chrono::milliseconds(std::llround(scope.watch_s * 1000));
  while (Client::Clock::now() < end && !(*client)->interrupted()) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Client::Clock::now());
    const auto health = (*client)->next_health(left);
    if (!health) break;
    seen.later.clear();
    for (const auto& message : health->healths) seen.later.push_back(message.snapshot);
    seen.watched_s = std::chrono::duration<double>(Client::Clock::now() - began).count();
  }
  return seen;
}

// The daemon of this configuration, unless somebody has named another one.
Scope as_configured(Scope scope, const bushd::Result<bushd::config::Config>& config) {
  bushd::client::ClientOptions& client = scope.client;
  if (!config || client.way != bushd::client::ClientOptions::Way::kAny) return scope;
  client.url = config->lcm.url;
  client.prefix = config->lcm.prefix;
  const auto paths = socket_paths(client, config);
  if (paths.size() == 1) client.socket = paths.front();
  return scope;
}

// The file of the daemon that runs here, if it tells; else that of the service.
std::string configuration_to_examine(const Scope& scope) {
  if (const auto client = Client::open(scope.client); client && !(*client)->link().loses()) {
    DaemonSeen seen;
    ask_for_configuration(**client, seen);
    std::error_code error;
    if (!seen.config_path.empty() && fs::exists(seen.config_path, error)) return seen.config_path;
  }
  return kSystemConfig;
}

// The match of a pattern that the daemon has open; "": none is, or nobody says.
std::string port_in_use(const DaemonSeen& daemon, const std::string& bus) {
  for (const auto& description : daemon.status.descriptions) {
    if (description.snapshot.bus == bus && !description.snapshot.port.empty()) {
      return description.snapshot.port;
    }
  }
  return "";
}

std::uint64_t drops_of(const LcmSeen& lcm) {
  std::uint64_t drops = 0;
  for (const UdpSocket& socket : lcm.sockets) drops += socket.drops;
  return drops;
}

}  // namespace

Observations observe(const Scope& as_asked) {
  Scope asked = as_asked;
  if (asked.config_path.empty()) asked.config_path = configuration_to_examine(asked);
  const auto config = bushd::config::load(asked.config_path);
  const Scope scope = as_configured(asked, config);
  Observations seen;
  seen.asking = asking_user();
  seen.serving = serving_user(scope.config_path, seen.asking);
  seen.configuration = configuration_of(scope.config_path, config);
  seen.adapters = serial_adapters();
  seen.lcm = lcm_seen(bushd::client::lcm_url(config ? config->lcm.url : scope.client.url));
  seen.clock = clock_seen();
  seen.folders = folders_of(config);
  for (const std::string& path : socket_paths(scope.client, config)) {
    seen.sockets.push_back(socket_seen(path, seen.asking));
  }
  const std::string url = seen.lcm.url;
  const std::uint64_t no_room = datagrams_without_room(text_of("/proc/net/snmp"));
  const std::uint64_t drops = drops_of(seen.lcm);
  seen.daemon = daemon_seen(scope);
  if (config) {
    for (const auto& bus : config->buses) {
      seen.ports.push_back(port_seen(bus.name, bus.port, port_in_use(seen.daemon, bus.name)));
    }
  }
  // The kernel counts for a socket also what the filter of its program refuses, and for all
  // programs of this PC what found no room: of the sockets at this port it is what both have
  // counted.
  seen.lcm = lcm_seen(url);
  seen.lcm.lost_meanwhile = std::min(datagrams_without_room(text_of("/proc/net/snmp")) - no_room,
                                     drops_of(seen.lcm) - std::min(drops, drops_of(seen.lcm)));
  return seen;
}

}  // namespace bushctl::doctor
