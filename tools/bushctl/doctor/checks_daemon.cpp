// What is wrong with the daemon, and what it knows of MCUs and positions.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <set>

#include "api/words.h"
#include "diagnosis.h"
#include "words/remedy.h"

namespace bushctl::doctor {
namespace {

namespace api = bushd::api;
namespace words = bushd::words;

constexpr const char* kStart =
    "'systemctl status bushd' says why; 'sudo systemctl start bushd' starts it";
constexpr std::int64_t kClocksDifferUs = 2'000'000;

// An MCU and what the daemon says of it. Computed axes are no MCUs: what there is to say is said of
// their motors.
template <class Visit>
void for_each_mcu(const Observations& seen, Visit visit) {
  const auto& status = seen.daemon.status;
  for (std::size_t i = 0; i < status.states.size(); ++i) {
    if (status.descriptions.at(i).snapshot.is_mcu()) visit(status.states[i].snapshot);
  }
}

bool answers(const Observations& seen) {
  return seen.daemon.unreachable.empty();
}

Finding no_right(const SocketSeen& socket, const User& asking) {
  const std::string seen = fmt::format("{} is for group {}, and {} is not in it", socket.path,
                                       socket.group, asking.name);
  if (socket.group == "root") {
    return {Level::kError, "socket", seen, "set [control] group in bushd.toml, and restart bushd"};
  }
  if (socket.is_member_elsewhere) {
    return {Level::kError, "socket", seen + " since this login",
            "log in again, or run 'newgrp " + socket.group + "'"};
  }
  return {Level::kError, "socket", seen,
          fmt::format("sudo usermod -aG {} {}, then log in again", socket.group, asking.name)};
}

void check_file(const Observations& seen, Findings& out) {
  const DaemonSeen& daemon = seen.daemon;
  const ConfigurationSeen& file = seen.configuration;
  if (daemon.config_path.empty() || !file.exists) return;
  if (daemon.config_path != file.path) {
    out.push_back({Level::kWarning, "daemon",
                   "the daemon has another configuration: " + daemon.config_path,
                   "'bushctl doctor --config " + daemon.config_path + "'"});
  } else if (!file.sha256.empty() && daemon.config_sha256 != file.sha256) {
    out.push_back({Level::kWarning, "daemon", file.path + " was changed since bushd has read it",
                   "sudo systemctl restart bushd: motors ramp down first"});
  }
}

void check_messages(const Observations& seen, Findings& out) {
  const auto& status = seen.daemon.status;
  if (status.missing_mcus.count > 0 || status.lost > 0) {
    out.push_back({Level::kWarning, "daemon",
                   fmt::format("{} of {} MCUs did not arrive, {} messages were lost",
                               status.missing_mcus.count, status.missing_mcus.of, status.lost),
                   "use the control socket, or give LCM more room: sudo sysctl "
                   "net.core.rmem_max=4194304"});
  }
  std::int64_t dropped = 0;
  std::int64_t newest_us = 0;
  for (const auto& state : status.states) {
    dropped = std::max(dropped, state.dropped_messages);
    newest_us = std::max(newest_us, state.part.utime_us);
  }
  if (dropped > 0) {
    out.push_back({Level::kWarning, "daemon",
                   fmt::format("{} messages of clients were no valid ones, or clients were "
                               "disconnected",
                               dropped),
                   "look for clients of another version, or programs on LCM's channels that are "
                   "none of bushd's"});
  }
  const std::int64_t apart_us = std::abs(newest_us - seen.daemon.unix_us);
  if (newest_us > 0 && apart_us > kClocksDifferUs) {
    out.push_back(
        {Level::kWarning, "clock",
         fmt::format("the daemon's clock differs by {} s from this PC's", apart_us / 1'000'000),
         "'timedatectl set-ntp true' on both PCs"});
  }
}

Finding of_mcu(const api::StateSnapshot& mcu, std::string seen, std::string remedy,
               std::string of_several) {
  return {.level = Level::kError,
          .check = "mcu",
          .seen = std::move(seen),
          .remedy = std::move(remedy),
          .about = mcu.mcu,
          .of_several = std::move(of_several)};
}

Finding offline(const api::StateSnapshot& mcu) {
  constexpr const char* kSeveral = "MCUs are offline";
  const std::string seen = fmt::format("{} is offline: {}", mcu.mcu, mcu.detail);
  if (mcu.detail.find("protocol version") != std::string::npos) {
    return of_mcu(
        mcu, seen,
        "'bushd-flash --check' compares image and daemon; flash the MCU, or upgrade bushd",
        kSeveral);
  }
  if (mcu.detail.find("shares its address") != std::string::npos) {
    return of_mcu(
        mcu, seen,
        "stop bushd; 'bushctl scan PORT --baud B' shows both, 'bushctl address PORT UNIQUE_ID NEW "
        "--baud B' gives one another address",
        kSeveral);
  }
  return of_mcu(
      mcu, seen,
      "is it powered, is its address and baud rate that of bushd.toml, are A and B swapped? "
      "Stop bushd: 'bushctl scan PORT --baud B' shows who answers",
      kSeveral);
}

// Compares the firmware of all MCUs, bus by bus.
void check_versions(const Observations& seen, Findings& out) {
  std::set<std::int32_t> versions;
  std::size_t heard = 0;
  for (const api::HealthSnapshot& health : newest_healths(seen.daemon)) {
    for (const api::McuHealth& mcu : health.mcus) {
      if (mcu.unique_id.empty()) continue;
      ++heard;
      versions.insert(mcu.firmware_version);
    }
  }
  if (versions.size() > 1) {
    out.push_back(
        {Level::kWarning, "mcu",
         fmt::format("MCUs have different firmware: versions {}", fmt::join(versions, ", ")),
         "'bushctl health' shows which; flash the older ones (bushd-flash)"});
  } else if (heard > 0 && out.empty()) {
    out.push_back({Level::kOk, "mcu",
                   fmt::format("{} online, firmware version {}", heard, *versions.begin()), ""});
  }
}

// How its position becomes known, as far as this PC knows what the motor has.
std::string home_or_set(const Observations& seen, const std::string& motor) {
  const std::string set = "find out where it stands and run " + words::set_remedy(motor);
  const ConfigurationSeen& file = seen.configuration;
  const bool told = !file.path.empty() && file.path == seen.daemon.config_path;
  if (!told) return words::remedy("home", motor) + " if it has a home switch, or " + set;
  const bool has_home = std::ranges::find(file.with_home, motor) != file.with_home.end();
  return (has_home ? "run " + words::remedy("home", motor) + ", or " : "") + set;
}

Finding position(const Observations& seen, const api::MotorState& motor) {
  const std::string why =
      motor.uncertain_reason.empty() ? "" : ", " + std::string(motor.uncertain_reason);
  Finding finding{.level = Level::kWarning,
                  .check = "position",
                  .seen = fmt::format("{} is {}{}", motor.name, word(motor.trust), why),
                  .remedy = home_or_set(seen, motor.name),
                  .about = motor.name,
                  .of_several = fmt::format("motors are {}", word(motor.trust))};
  if (motor.trust == api::Trust::kRestored) {
    finding.remedy = "look at the motor: " + words::remedy("confirm", motor.name) +
                     " if it has not been turned, else " + finding.remedy;
  }
  return finding;
}

}  // namespace

Findings check_sockets(const Observations& seen) {
  const SocketSeen* best = nullptr;
  for (const SocketSeen& socket : seen.sockets) {
    if (best == nullptr || socket.state > best->state) best = &socket;
  }
  if (best == nullptr) return {};
  switch (best->state) {
    case SocketSeen::State::kListens:
      return {{Level::kOk, "socket", fmt::format("{}, for group {}", best->path, best->group), ""}};
    case SocketSeen::State::kNoRight:
      return {no_right(*best, seen.asking)};
    case SocketSeen::State::kNobodyListens:
      return {{Level::kError, "socket", best->path + " is there, and nobody listens", kStart}};
    case SocketSeen::State::kAbsent:
      break;
  }
  return {{Level::kError, "socket", "there is no control socket at " + best->path, kStart}};
}

Findings check_daemon(const Observations& seen) {
  if (!answers(seen)) {
    return {{Level::kError, "daemon", seen.daemon.unreachable, kStart}};
  }
  Findings out;
  if (!seen.daemon.by_socket) {
    out.push_back(
        {Level::kWarning, "daemon",
         "it answers by LCM only, to which the control socket is preferred",
         seen.configuration.lcm_commands
             ? "see 'socket' above"
             : "see 'socket' above: [lcm] commands = false, so this user cannot command"});
  }
  check_file(seen, out);
  check_messages(seen, out);
  if (out.empty()) out.push_back({Level::kOk, "daemon", "answers by the control socket", ""});
  return out;
}

Findings check_mcus(const Observations& seen) {
  Findings out;
  if (!answers(seen)) return out;
  for_each_mcu(seen, [&](const api::StateSnapshot& mcu) {
    if (mcu.state == api::McuState::kOffline) {
      out.push_back(offline(mcu));
    } else if (mcu.state == api::McuState::kFault) {
      out.push_back(
          of_mcu(mcu, fmt::format("{}: {}", mcu.mcu, mcu.detail),
                 "remove the cause, then 'bushctl clear' (docs/troubleshooting.md, Moves)",
                 "MCUs have a fault"));
    }
  });
  check_versions(seen, out);
  return out;
}

Findings check_positions(const Observations& seen) {
  Findings out;
  if (!answers(seen)) return out;
  std::size_t known = 0;
  for_each_mcu(seen, [&](const api::StateSnapshot& mcu) {
    for (const api::MotorState& motor : mcu.motors) {
      if (motor.trust == api::Trust::kRestored || motor.trust == api::Trust::kUncertain) {
        out.push_back(position(seen, motor));
      } else if (motor.trust == api::Trust::kKnown) {
        ++known;
      }
    }
  });
  if (out.empty() && known > 0) {
    out.push_back({Level::kOk, "position", fmt::format("{} motors, all known", known), ""});
  }
  return out;
}

}  // namespace bushctl::doctor
