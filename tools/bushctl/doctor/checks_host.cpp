// What is wrong with this PC: configuration, serial ports, LCM, clock, disk.
#include <fmt/format.h>

#include <algorithm>

#include "diagnosis.h"
#include "lcm/receive_buffer.h"
#include "rights.h"

namespace bushctl::doctor {
namespace {

// 2024-01-01: no PC that runs this program has an earlier clock, but for one whose battery is
// empty.
constexpr std::int64_t kPlausibleUs = 1'704'067'200'000'000;
// The log of moves takes about 1 KB a move, the state store a few MB: days, and hours.
constexpr std::uint64_t kFreeEnough = 512ull << 20;
constexpr std::uint64_t kFreeLeast = 32ull << 20;
constexpr std::uint64_t kFreeFiles = 100;
constexpr std::uint64_t kBufferEnough = bushd::lcm::kReceiveBufferBytes;
constexpr std::uint64_t kManyQueuedBytes = 1ull << 20;

std::string megabytes(std::uint64_t bytes) {
  return fmt::format("{} MB", bytes >> 20);
}

std::string who(const Holder& holder) {
  return fmt::format("{} (pid {})", holder.program.empty() ? "a program" : holder.program,
                     holder.pid);
}

bool is_ours(const Holder& holder) {
  return holder.program == "bushd" || holder.program == "bushsim";
}

Finding absent(const PortSeen& port, const std::vector<std::string>& adapters) {
  const std::string seen = fmt::format("{}: {} is not there", port.bus, port.configured);
  if (adapters.empty()) {
    return {Level::kError, "port", seen,
            "plug the adapter in; 'journalctl -k' says whether the PC has noticed it"};
  }
  return {Level::kError, "port", seen,
          fmt::format("plug the adapter in, or name one of those that are there as 'port' of bus "
                      "\"{}\": {}",
                      port.bus, fmt::join(adapters, ", "))};
}

void check_rights(const PortSeen& port, const User& daemon, Findings& out) {
  if (may_use(port.rights, daemon)) return;
  out.push_back(
      {Level::kError, "port",
       fmt::format("{}: user {} may not use {} ({:04o}, group {})", port.bus, daemon.name,
                   port.path, port.rights.mode & 07777, port.rights.group),
       fmt::format("sudo usermod -aG {} {}, then restart bushd", port.rights.group, daemon.name)});
}

void check_holders(const PortSeen& port, Findings& out) {
  const auto other = std::ranges::find_if_not(port.holders, is_ours);
  const auto daemons = std::ranges::count(port.holders, "bushd", &Holder::program);
  if (other != port.holders.end()) {
    const bool modem = other->program == "ModemManager";
    out.push_back(
        {Level::kError, "port", fmt::format("{}: {} has {} open", port.bus, who(*other), port.path),
         modem ? "sudo systemctl disable --now ModemManager, or install the udev rules of "
                 "bushd's package"
               : "end that program: two on one line spoil each other's bytes"});
  } else if (daemons > 1) {
    out.push_back({Level::kError, "port",
                   fmt::format("{}: {} daemons have {} open", port.bus, daemons, port.path),
                   "end all but one: 'systemctl stop bushd', or those that were started by hand"});
  }
}

void check_latency_timer(const PortSeen& port, Findings& out) {
  if (!port.latency_timer_ms || *port.latency_timer_ms <= 1) return;
  const auto slash = port.target.rfind('/');
  const std::string name = port.target.substr(slash == std::string::npos ? 0 : slash + 1);
  out.push_back({Level::kWarning, "port",
                 fmt::format("{}: the adapter holds answers back for {} ms (latency_timer)",
                             port.bus, *port.latency_timer_ms),
                 fmt::format("echo 1 | sudo tee /sys/bus/usb-serial/devices/{}/latency_timer; the "
                             "udev rules of bushd's package do it for good",
                             name)});
}

}  // namespace

Findings check_configuration(const Observations& seen) {
  const ConfigurationSeen& configuration = seen.configuration;
  if (!configuration.exists) {
    return {{Level::kError, "configuration", configuration.path + " is not there",
             "'sudo bushctl setup' finds adapters and MCUs and writes it; another file: --config"}};
  }
  if (!configuration.error.empty()) {
    return {{Level::kError, "configuration", configuration.error,
             "mend it, check it with 'bushd --check-config " + configuration.path +
                 "', and restart bushd"}};
  }
  if (!may_read(configuration.rights, seen.serving)) {
    return {{Level::kError, "configuration",
             fmt::format("{}: user {} may not read it ({:04o}, group {})", configuration.path,
                         seen.serving.name, configuration.rights.mode & 07777,
                         configuration.rights.group),
             "sudo chmod 0644 " + configuration.path}};
  }
  return {{Level::kOk, "configuration",
           fmt::format("{}: {}", configuration.path, configuration.extent), ""}};
}

Findings check_ports(const Observations& seen) {
  Findings out;
  for (const PortSeen& port : seen.ports) {
    const std::size_t before = out.size();
    if (port.path.empty()) {
      out.push_back(absent(port, seen.adapters));
    } else if (!port.is_device) {
      out.push_back({Level::kError, "port",
                     fmt::format("{}: {} is no serial port", port.bus, port.path),
                     "name the adapter's port: 'ls /dev/serial/by-id /dev/bushd'"});
    } else {
      check_rights(port, seen.serving, out);
      check_holders(port, out);
      check_latency_timer(port, out);
    }
    if (out.size() > before) continue;
    const auto holder = std::ranges::find(port.holders, "bushd", &Holder::program);
    out.push_back({Level::kOk, "port",
                   fmt::format("{}: {}{}", port.bus, port.path,
                               holder == port.holders.end() ? "" : ", open by " + who(*holder)),
                   ""});
  }
  return out;
}

Findings check_lcm(const Observations& seen) {
  const LcmSeen& lcm = seen.lcm;
  if (!lcm.multicast) return {};
  if (!lcm.device) {
    return {{Level::kWarning, "lcm",
             "there is no route for " + lcm.address + ": LCM cannot be used",
             "sudo systemctl start bushd-lcm-route, or by hand: sudo ip route replace " +
                 lcm.address + "/32 dev lo src 127.0.0.1. The control socket needs none"}};
  }
  Findings out;
  const bool local = *lcm.device == "lo";
  if (local && lcm.ttl > 0) {
    out.push_back({Level::kWarning, "lcm",
                   fmt::format("url has ttl={}, and the route of {} leads to lo: other PCs hear "
                               "nothing",
                               lcm.ttl, lcm.address),
                   "BUSHD_LCM_DEVICE=DEVICE in /etc/default/bushd (man bushd), or ttl=0"});
  }
  if (!local && lcm.ttl == 0) {
    out.push_back({Level::kWarning, "lcm",
                   fmt::format("the route of {} leads to {}, although url has ttl=0", lcm.address,
                               *lcm.device),
                   "sudo systemctl restart bushd-lcm-route: LCM stops when that network does"});
  }
  std::uint64_t queued = 0;
  for (const UdpSocket& socket : lcm.sockets) queued = std::max(queued, socket.queued_bytes);
  if (lcm.lost_meanwhile > 0 || queued > kManyQueuedBytes) {
    out.push_back({Level::kWarning, "lcm",
                   fmt::format("{} datagrams found no room at port {} while doctor looked; {} KB "
                               "wait in the fullest queue",
                               lcm.lost_meanwhile, lcm.port, queued >> 10),
                   "a program there does not keep up: give it more room (sudo sysctl "
                   "net.core.rmem_max=4194304, and restart it), or let it use the control socket"});
  } else if (lcm.largest_buffer > 0 && lcm.largest_buffer < kBufferEnough) {
    out.push_back(
        {Level::kWarning, "lcm",
         fmt::format("net.core.rmem_max is {}: bursts of states are lost", lcm.largest_buffer),
         "sudo sysctl net.core.rmem_max=4194304; /etc/sysctl.d keeps it"});
  }
  if (out.empty()) {
    out.push_back({Level::kOk, "lcm",
                   fmt::format("{} by {}, {} sockets, nothing lost", lcm.address, *lcm.device,
                               lcm.sockets.size()),
                   ""});
  }
  return out;
}

Findings check_clock(const Observations& seen) {
  if (seen.clock.unix_us < kPlausibleUs) {
    return {{Level::kError, "clock", "this PC's clock is years behind",
             "set it: 'timedatectl set-ntp true', or 'timedatectl set-time'. Logs and the history "
             "of positions bear its times"}};
  }
  if (seen.clock.synchronised == false) {
    return {{Level::kWarning, "clock", "this PC's clock is not synchronised",
             "'timedatectl set-ntp true' (package systemd-timesyncd or chrony). Motion does not "
             "need it; logs are compared by it"}};
  }
  return {{Level::kOk, "clock", seen.clock.synchronised ? "synchronised" : "plausible", ""}};
}

Findings check_disk(const Observations& seen) {
  Findings out;
  for (const FolderSeen& folder : seen.folders) {
    const std::string name = fmt::format("{} ({})", folder.path, folder.what);
    if (!folder.exists) {
      out.push_back({Level::kError, "disk", name + " is not there",
                     fmt::format("sudo install -d -o {0} -g {0} -m 0750 {1}", seen.serving.name,
                                 folder.path)});
    } else if (!may_write_folder(folder.rights, seen.serving)) {
      out.push_back({Level::kError, "disk",
                     fmt::format("{}: user {} may not write there", name, seen.serving.name),
                     fmt::format("sudo chown -R {0}: {1}", seen.serving.name, folder.path)});
    } else if (folder.free_bytes < kFreeEnough ||
               (folder.counts_files && folder.free_files < kFreeFiles)) {
      const bool bytes = folder.free_bytes < kFreeEnough;
      const bool full = !bytes || folder.free_bytes < kFreeLeast;
      out.push_back({full ? Level::kError : Level::kWarning, "disk",
                     fmt::format("{}: {} free", name,
                                 bytes ? megabytes(folder.free_bytes)
                                       : fmt::format("{} files", folder.free_files)),
                     "make room ('du -xh --max-depth 2 /var | sort -h'): moves are refused once "
                     "positions cannot be kept"});
    } else {
      out.push_back(
          {Level::kOk, "disk", fmt::format("{}: {} free", name, megabytes(folder.free_bytes)), ""});
    }
  }
  return out;
}

}  // namespace bushctl::doctor
