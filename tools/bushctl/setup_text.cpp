#include "setup_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "bus/rs485/unique_id.h"

namespace bushctl {
namespace {

using bushd::link::unique_id_text;

constexpr const char* kTable = "bushd2-constant";

bool speaks_ours(const Found& mcu) {
  return mcu.identity.protocol_version == BUSHD_PROTOCOL_VERSION;
}

// In the order of addresses, each address once; then what cannot be named.
struct Sorted {
  std::vector<Found> usable;
  std::vector<Found> others;
};
Sorted sorted(const FoundBus& bus) {
  std::vector<Found> mcus = bus.mcus;
  std::ranges::stable_sort(mcus, {}, &Found::address);
  Sorted out;
  std::set<std::uint8_t> taken;
  for (const Found& mcu : mcus) {
    const bool usable = speaks_ours(mcu) && taken.insert(mcu.address).second;
    (usable ? out.usable : out.others).push_back(mcu);
  }
  return out;
}

std::string about(const Found& mcu) {
  return fmt::format("unique id {}, firmware {}, {} outputs", unique_id_text(mcu.identity),
                     mcu.identity.firmware_version, mcu.identity.motors);
}

std::string trouble(const Found& mcu) {
  if (!speaks_ours(mcu)) {
    return fmt::format(
        "address {} speaks protocol version {}, bushd version {}: flash it "
        "(bushd-flash)",
        mcu.address, mcu.identity.protocol_version, BUSHD_PROTOCOL_VERSION);
  }
  return fmt::format(
      "address {} is that of another MCU too: 'bushctl address PORT {} NEW --baud B' gives it "
      "another",
      mcu.address, unique_id_text(mcu.identity));
}

std::string in_quotes(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

std::string head(const std::string& path) {
  return fmt::format(R"(# {0}: what bushd moves, begun by 'bushctl setup' with what it found.
# bushd.toml(5) explains every key. A line that begins with # and a key has no effect yet: take the #
# away. After each change:
#
#   bushd --check-config {0}
#   systemctl restart bushd

# LCM tells nobody who asks: with commands = true every user of this PC could move motors, and whoever
# the network lets through. So it publishes states only; members of the group bushd command by the
# control socket.
[lcm]
commands = false
)",
                     path);
}

std::string bus_text(const std::string& name, const FoundBus& bus, std::uint32_t tick_us) {
  return fmt::format(R"(
[[bus]]
name = "{}"
port = {}
baud = {}
tick_us = {}
format = "fine"      # 2 bytes a motor and tick; "coarse": 1 byte, for full steps
#moves = "table"     # MCUs run whole moves by their own copies of tables; "stream": tick by tick
)",
                     name, in_quotes(bus.port), bus.baud, tick_us);
}

std::string mcu_text(const std::string& bus, const Found& mcu) {
  return fmt::format(R"(
# {}
[[mcu]]
bus = "{}"
address = {}
#enable_active = "low"     # of A4988, DRV8825, TMC and many others
#idle_disable_s = 60       # drivers off after a rest of all its motors
)",
                     about(mcu), bus, mcu.address);
}

// The first output of each MCU has a motor; as many as there may be would ask too much of a slow
// line, and nobody knows which are connected.
std::string motor_text(const std::string& bus, const Found& mcu, const std::string& prefix) {
  std::string text = fmt::format(R"(
[[motor]]
name = "{0}m{2}-0"
mcu = "{1}:{2}"
output = 0
group = "all"
#description = "sample rotation"
#unit = "deg"             # without: positions are steps
#steps_per_unit = "400/1.25"
#soft_limits = [-5, 30]
)",
                                 prefix, bus, mcu.address);
  if (mcu.identity.motors > 1) {
    text += fmt::format(R"(
#[[motor]]                # so on up to output {3}
#name = "{0}m{2}-1"
#mcu = "{1}:{2}"
#output = 1
#group = "all"
)",
                        prefix, bus, mcu.address, mcu.identity.motors - 1);
  }
  return text;
}

}  // namespace

bool has_usable_mcu(const FoundBus& bus) {
  return !sorted(bus).usable.empty();
}

std::string configuration_text(const std::vector<FoundBus>& buses, std::uint32_t tick_us,
                               const std::string& path) {
  std::string text = head(path);
  std::string motors;
  for (std::size_t i = 0; i < buses.size(); ++i) {
    const Sorted mcus = sorted(buses[i]);
    if (mcus.usable.empty()) continue;
    const std::string name = fmt::format("bus{}", i + 1);
    text += bus_text(name, buses[i], tick_us);
    for (const Found& mcu : mcus.usable) {
      text += mcu_text(name, mcu);
      motors += motor_text(name, mcu, buses.size() == 1 ? "" : name + "-");
    }
    for (const Found& mcu : mcus.others) text += fmt::format("\n# {}\n", trouble(mcu));
  }
  text += fmt::format(R"(
# Motors of a group have the same table: 'bushtab list' shows them, 'bushtab new' makes one.
[[group]]
name = "all"
table = "{}"
)",
                      kTable);
  return text + motors;
}

std::vector<std::string> found_lines(const FoundBus& bus) {
  const Sorted mcus = sorted(bus);
  std::vector<std::string> out;
  for (const Found& mcu : mcus.usable) {
    out.push_back(
        fmt::format("{}: {} baud, address {}: {}", bus.port, bus.baud, mcu.address, about(mcu)));
  }
  for (const Found& mcu : mcus.others) {
    out.push_back(fmt::format("{}: {} baud, {}", bus.port, bus.baud, trouble(mcu)));
  }
  return out;
}

std::vector<std::string> nothing_found_lines(const std::vector<std::string>& ports) {
  std::vector<std::string> out;
  if (ports.empty()) {
    out.emplace_back(
        "no serial adapter is plugged in (/dev/serial/by-id, /dev/ttyUSB*, /dev/ttyACM*); a "
        "built-in port is named: bushctl setup /dev/ttyS0");
  } else {
    out.emplace_back(
        "no MCU was found: look at its power, at A and B of the bus, at the 120 ohm at both ends "
        "and, with --baud, at its baud rate");
  }
  out.emplace_back(
      "to try bushd without hardware: sudo apt install bushd-sim, sudo systemctl start "
      "bushd-sim@demo, sudo cp /etc/bushd/sim/demo.toml /etc/bushd/bushd.toml, sudo systemctl "
      "start bushd");
  return out;
}

}  // namespace bushctl
