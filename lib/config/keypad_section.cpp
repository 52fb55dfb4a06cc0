#include "config/keypad_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "config/port_check.h"
#include "config/words.h"

namespace bushd::config {
Result<Keypad> read_keypad(const tables::TomlReader& reader, const Config& config) {
  if (auto known = reader.only(
          {"port", "baud", "motor", "mode", "delay_us", "slower_us", "slowest_us", "keepalive_ms"});
      !known) {
    return fail(known.error());
  }
  Keypad keypad;
  constexpr std::string_view kPortRule = "the path of a serial port, such as \"/dev/ttyUSB0\"";
  auto port = reader.string("port", kPortRule);
  if (!port) return fail(port.error());
  if (port->empty() || port->find('\0') != std::string::npos) {
    return refuse(reader, "port", "", kPortRule);
  }
  if (auto free = check_keypad_port(reader, *port, config); !free) return fail(free.error());
  keypad.port = std::move(*port);
  keypad.port_at = reader.error("port", "");
  const auto motor = reader.string("motor", "the name of a motor");
  if (!motor) return fail(motor.error());
  const auto found = std::ranges::find(config.motors, *motor, &Motor::name);
  if (found == config.motors.end()) return refuse(reader, "motor", *motor, "the name of a motor");
  keypad.motor = MotorId{static_cast<std::size_t>(found - config.motors.begin())};
  const Keys keys = Keys(reader)
                        .word("mode", &keypad.latched, {"hold", "latch"})
                        .whole("baud", &keypad.baud, 50, 4'000'000, "bit/s")
                        .whole("delay_us", &keypad.delay_us, 10, 10'000'000, "us")
                        .whole("slower_us", &keypad.slower_us, 1, 10'000'000, "us")
                        .whole("slowest_us", &keypad.slowest_us, 10, 10'000'000, "us")
                        .whole("keepalive_ms", &keypad.keepalive_ms, 50, 10'000, "ms");
  if (!keys.result()) return fail(keys.result().error());
  if (keypad.slowest_us < keypad.delay_us) {
    const char* const key = reader.has("slowest_us") ? "slowest_us" : "delay_us";
    return fail(reader.error(key, fmt::format("slowest_us = {} is below delay_us = {}; allowed: "
                                              "slowest_us of that or more",
                                              keypad.slowest_us, keypad.delay_us)));
  }
  return keypad;
}

}  // namespace bushd::config
